// How does a function say that the world, not the program, is at fault?
//
// With absl::Status and absl::StatusOr, both [[nodiscard]]. A message is one sentence: what is
// wrong, where, and what to do about it. A fault of our own is LUCERNA_CHECK: the process ends.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

namespace lucerna {

using absl::Status;
using absl::StatusOr;

[[noreturn]] inline void CheckFailed(const char* what, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: broken invariant: %s\n", file, line, what);
  std::abort();
}

}  // namespace lucerna

#define LUCERNA_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::lucerna::CheckFailed(#condition, __FILE__, __LINE__))

// Hands a failure on to the caller.
#define LUCERNA_RETURN_IF_ERROR(expression)                                 \
  do {                                                                      \
    if (absl::Status status_ = (expression); !status_.ok()) return status_; \
  } while (false)

#define LUCERNA_CONCAT_INNER(a, b) a##b
#define LUCERNA_CONCAT(a, b) LUCERNA_CONCAT_INNER(a, b)

// LUCERNA_ASSIGN_OR_RETURN(auto value, Make()): the value, or the failure to the caller.
#define LUCERNA_ASSIGN_OR_RETURN(target, expression) \
  LUCERNA_ASSIGN_OR_RETURN_INNER(LUCERNA_CONCAT(status_or_, __LINE__), target, expression)
#define LUCERNA_ASSIGN_OR_RETURN_INNER(temporary, target, expression) \
  auto temporary = (expression);                                      \
  if (!temporary.ok()) return std::move(temporary).status();          \
  target = std::move(temporary).value()
