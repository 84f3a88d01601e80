#include "render/formats/pbrt/graphics_state.h"

#include <utility>

#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr std::size_t kMaxNesting = 1000;  // AttributeBegin within AttributeBegin

}  // namespace

Status GraphicsStack::Begin(std::string_view directive, const SourceLocation& location) {
  if (scopes_.size() >= kMaxNesting) {
    return absl::ResourceExhaustedError(
        Concat("scopes are nested more than ", kMaxNesting, " deep"));
  }
  scopes_.push_back({directive, location, state_});
  return absl::OkStatus();
}

Status GraphicsStack::End(std::string_view directive, std::string_view begun_by) {
  if (scopes_.empty()) {
    return absl::InvalidArgumentError(Concat(directive, " without ", begun_by));
  }
  const Scope& innermost = scopes_.back();
  if (innermost.begun_by != begun_by) {
    return absl::InvalidArgumentError(Concat(directive, " where the ", innermost.begun_by, " of ",
                                             *innermost.location.file, ":", innermost.location.line,
                                             " is still open"));
  }
  state_ = std::move(scopes_.back().saved);
  scopes_.pop_back();
  return absl::OkStatus();
}

}  // namespace lucerna
