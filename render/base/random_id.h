// Which name can nobody guess?
//
// Ids that give access by being known, and secrets, come from the system's random numbers. Random
// numbers that an image depends on have keys instead (render/math/rng.h).
#pragma once

#include <cstddef>
#include <string>

namespace lucerna {

// `count` bytes from the system's cryptographic generator. Waits only while a machine that has just
// been started has not gathered enough randomness. Threads: any.
[[nodiscard]] std::string RandomBytes(std::size_t count);

// 128 random bits as 32 lower-case hexadecimal digits. Threads: any.
[[nodiscard]] std::string RandomId();

}  // namespace lucerna
