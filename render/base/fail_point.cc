#include "render/base/fail_point.h"

#include <atomic>
#include <charconv>
#include <csignal>
#include <string>

#include <signal.h>

namespace lucerna {
namespace {

std::atomic<bool> is_armed = false;
std::atomic<int> visits_left = 1;

std::string& ArmedName() {
  static std::string name;
  return name;
}

}  // namespace

void ArmFailPoint(std::string_view name_and_count) {
  const std::size_t colon = name_and_count.rfind(':');
  int count = 1;
  if (colon != std::string_view::npos) {
    const std::string_view digits = name_and_count.substr(colon + 1);
    std::from_chars(digits.data(), digits.data() + digits.size(), count);
  }
  ArmedName() = std::string(name_and_count.substr(0, colon));
  visits_left = count;
  is_armed = !ArmedName().empty();
}

void FailPoint(std::string_view name) {
  if (!is_armed || name != ArmedName()) return;
  if (--visits_left == 0) ::raise(SIGKILL);
}

bool FaultIsDue(std::string_view name) {
  if (!is_armed || name != ArmedName()) return false;
  return --visits_left <= 0;
}

}  // namespace lucerna
