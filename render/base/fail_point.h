// At which step does a test kill this process, or make it do wrong?
//
// Code that makes something durable names its steps. A test starts a program with the environment
// variable LUCERNA_FAIL_POINT=NAME, and the process kills itself by SIGKILL when it comes to the
// step of that name; with NAME:3 when it comes there for the third time. Without the variable,
// which only a main reads, a step costs one load.
//
// Some names are faults instead: from that visit on, the program does what is wrong in a known way.
#pragma once

#include <string_view>

namespace lucerna {

// Once, before other threads start. Empty: no step.
void ArmFailPoint(std::string_view name_and_count);

// The step called `name` is reached. Threads: any.
void FailPoint(std::string_view name);

// Whether the fault called `name` is to happen at this visit. Threads: any.
[[nodiscard]] bool FaultIsDue(std::string_view name);

}  // namespace lucerna
