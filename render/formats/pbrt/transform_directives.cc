#include <array>

#include "render/base/text.h"
#include "render/formats/pbrt/directives.h"

namespace lucerna {
namespace {

void ReportProjective(Arguments& arguments) {
  arguments.Error(Concat(arguments.directive(),
                         " needs transforms that are affine: the 4th, 8th, 12th and 16th numbers "
                         "of Transform and ConcatTransform must be 0, 0, 0 and 1"));
}

}  // namespace

bool HasTranslation(const TransformPair& transforms) {
  const Vec3 origin = {0, 0, 0};
  return transforms.start.Point(origin) != origin || transforms.end.Point(origin) != origin;
}

bool DirectiveReader::Replace(Arguments& arguments, const TransformPair& transforms) {
  if (transforms.start.IsFinite() && transforms.end.IsFinite()) {
    graphics_.state().to_world = transforms;
  } else {
    arguments.Error(Concat(arguments.directive(), " makes a transform that is not finite"));
  }
  return true;
}

bool DirectiveReader::Replace(Arguments& arguments, const Transform& transform,
                              bool is_projective) {
  const GraphicsState& state = graphics_.state();
  TransformPair replaced = state.to_world;
  const bool keeps_one = !state.changes_start || !state.changes_end;
  replaced.is_projective = is_projective || (keeps_one && replaced.is_projective);
  if (state.changes_start) replaced.start = transform;
  if (state.changes_end) replaced.end = transform;
  return Replace(arguments, replaced);
}

bool DirectiveReader::Concatenate(Arguments& arguments, const StatusOr<Transform>& transform,
                                  bool is_projective) {
  if (!transform.ok()) {
    arguments.Error(std::string(transform.status().message()));
    return true;
  }
  const GraphicsState& state = graphics_.state();
  TransformPair joined = state.to_world;
  if (is_projective && HasTranslation(joined)) {
    ReportProjective(arguments);
    return true;
  }
  joined.is_projective = joined.is_projective || is_projective;
  if (state.changes_start) joined.start = joined.start * *transform;
  if (state.changes_end) joined.end = joined.end * *transform;
  return Replace(arguments, joined);
}

bool DirectiveReader::OnIdentity(Arguments& arguments) {
  return Replace(arguments, Transform());
}

bool DirectiveReader::OnTranslate(Arguments& arguments) {
  std::array<double, 3> v{};
  return arguments.ReadNumbers(v) && Concatenate(arguments, Transform::Translate(v[0], v[1], v[2]));
}

bool DirectiveReader::OnScale(Arguments& arguments) {
  std::array<double, 3> v{};
  return arguments.ReadNumbers(v) && Concatenate(arguments, Transform::Scale(v[0], v[1], v[2]));
}

bool DirectiveReader::OnRotate(Arguments& arguments) {
  std::array<double, 4> v{};
  return arguments.ReadNumbers(v) &&
         Concatenate(arguments, Transform::Rotate(v[0], v[1], v[2], v[3]));
}

bool DirectiveReader::OnLookAt(Arguments& arguments) {
  std::array<double, 9> v{};
  return arguments.ReadNumbers(v) &&
         Concatenate(arguments,
                     Transform::LookAt({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]}));
}

bool DirectiveReader::ReadMatrix(Arguments& arguments, Transform& transform, bool& is_projective) {
  std::array<double, 16> v{};
  if (!arguments.ReadNumbers(v)) return false;
  std::array<std::array<double, 4>, 4> rows{};
  for (std::size_t i = 0; i < 16; ++i)
    rows[i % 4][i / 4] = v[i];  // column by column
  constexpr std::array<double, 4> kAffine = {0, 0, 0, 1};
  is_projective = rows[3] != kAffine;
  rows[3] = kAffine;
  transform = Transform(rows);
  return true;
}

bool DirectiveReader::CheckAffine(Arguments& arguments) {
  if (!graphics_.state().to_world.is_projective) return true;
  ReportProjective(arguments);
  return false;
}

bool DirectiveReader::OnTransform(Arguments& arguments) {
  Transform transform;
  bool is_projective = false;
  return ReadMatrix(arguments, transform, is_projective) &&
         Replace(arguments, transform, is_projective);
}

bool DirectiveReader::OnConcatTransform(Arguments& arguments) {
  Transform transform;
  bool is_projective = false;
  return ReadMatrix(arguments, transform, is_projective) &&
         Concatenate(arguments, transform, is_projective);
}

bool DirectiveReader::OnCoordinateSystem(Arguments& arguments) {
  std::string name;
  if (!arguments.ReadString("a name", name)) return false;
  coordinate_systems_[name] = graphics_.state().to_world;
  return true;
}

bool DirectiveReader::OnCoordSysTransform(Arguments& arguments) {
  std::string name;
  if (!arguments.ReadString("a name", name)) return false;
  const auto system = coordinate_systems_.find(name);
  if (system == coordinate_systems_.end()) {
    diagnostics_.Warning(
        arguments.location(),
        Concat("there is no coordinate system ", Quoted(name), ": CoordSysTransform is ignored"));
    return true;
  }
  return Replace(arguments, system->second);
}

bool DirectiveReader::OnActiveTransform(Arguments& arguments) {
  const Token token = arguments.tokens().Peek();
  if (token.kind != Token::Kind::kWord ||
      (token.text != "All" && token.text != "StartTime" && token.text != "EndTime")) {
    arguments.Error("ActiveTransform takes StartTime, EndTime or All");
    return false;
  }
  graphics_.state().changes_start = token.text != "EndTime";
  graphics_.state().changes_end = token.text != "StartTime";
  arguments.tokens().Next();
  return true;
}

bool DirectiveReader::OnTransformTimes(Arguments& arguments) {
  std::array<double, 2> v{};
  if (!arguments.ReadNumbers(v)) return false;
  if (v[0] < v[1]) {
    transform_start_ = v[0];
    transform_end_ = v[1];
  } else {
    arguments.Error(
        "TransformTimes takes the times of the transforms at the start and at the end "
        "of motions: the second must be later");
  }
  return true;
}

}  // namespace lucerna
