// Shape "curve": cubic and quadratic Bézier and B-spline curves.
//
// "flat" and "cylinder" are round tubes of short straight pieces: the ribbons of pbrt-v4 that turn
// to every ray are no surface that photons and eye paths could agree on. "ribbon" is a mesh.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "render/base/text.h"
#include "render/formats/pbrt/shape_readers.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

// Of a radius: how far the pieces may leave the curve.
constexpr double kChordError = 0.05;
// By which one piece may turn from the one before.
constexpr double kPieceTurnRad = 0.15;
constexpr int kMaxPieces = 64;

using Bezier = std::array<Double3, 4>;

Double3 PointOn(const Bezier& curve, double t) {
  const double s = 1 - t;
  return curve[0] * (s * s * s) + curve[1] * (3 * s * s * t) + curve[2] * (3 * s * t * t) +
         curve[3] * (t * t * t);
}

Double3 Tangent(const Bezier& curve, double t) {
  const double s = 1 - t;
  const Double3 tangent = (curve[1] - curve[0]) * (s * s) + (curve[2] - curve[1]) * (2 * s * t) +
                          (curve[3] - curve[2]) * (t * t);
  return Length(tangent) > 0 ? tangent : curve[3] - curve[0];
}

// A quadratic as a cubic.
Bezier Elevated(Double3 a, Double3 b, Double3 c) {
  return {a, a * (1.0 / 3) + b * (2.0 / 3), b * (2.0 / 3) + c * (1.0 / 3), c};
}

// The segments of the curve, one after the other; empty, and reported, when the number of control
// points is wrong.
std::vector<Bezier> SegmentsOf(ParameterList& parameters, std::span<const double> numbers) {
  const std::string basis = parameters.String("basis", "bezier");
  const auto degree =
      static_cast<std::size_t>(parameters.FindInteger("degree", {2, 3}).value_or(3));
  const auto at = [&](std::size_t i) {
    return Double3{numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
  };
  const std::size_t count = numbers.size() / 3;
  std::vector<Bezier> segments;
  if (basis == "bezier") {
    if (count < degree + 1 || (count - 1) % degree != 0) {
      parameters.Error(
          "P", Concat("must have ", degree, " n + 1 points for n Bezier segments, not ", count));
      return {};
    }
    for (std::size_t i = 0; i + degree < count; i += degree) {
      segments.push_back(degree == 2 ? Elevated(at(i), at(i + 1), at(i + 2))
                                     : Bezier{at(i), at(i + 1), at(i + 2), at(i + 3)});
    }
    return segments;
  }
  if (basis != "bspline") {
    parameters.Error("basis", Concat("must be bezier or bspline, not ", Quoted(basis)));
    return {};
  }
  if (count < degree + 1) {
    parameters.Error("P", Concat("must have at least ", degree + 1, " points, not ", count));
    return {};
  }
  for (std::size_t i = 0; i + degree < count; ++i) {
    if (degree == 2) {
      segments.push_back(
          Elevated((at(i) + at(i + 1)) * 0.5, at(i + 1), (at(i + 1) + at(i + 2)) * 0.5));
      continue;
    }
    const Double3 first = at(i + 1) * (2.0 / 3) + at(i + 2) * (1.0 / 3);
    const Double3 second = at(i + 1) * (1.0 / 3) + at(i + 2) * (2.0 / 3);
    const Double3 before = at(i) * (1.0 / 3) + at(i + 1) * (2.0 / 3);
    const Double3 after = at(i + 2) * (2.0 / 3) + at(i + 3) * (1.0 / 3);
    segments.push_back({(before + first) * 0.5, first, second, (second + after) * 0.5});
  }
  return segments;
}

double TurnBetween(Double3 a, Double3 b) {
  const double lengths = Length(a) * Length(b);
  return lengths > 0 ? std::atan2(Length(Cross(a, b)), Dot(a, b)) : 0;
}

// A curve leaves the chord of a piece by at most an eighth of its second derivative times the
// square of the piece.
int PiecesOf(const Bezier& curve, double radius) {
  const double bend = 6 * std::max(Length(curve[0] - curve[1] * 2 + curve[2]),
                                   Length(curve[1] - curve[2] * 2 + curve[3]));
  const double turn = TurnBetween(curve[1] - curve[0], curve[2] - curve[1]) +
                      TurnBetween(curve[2] - curve[1], curve[3] - curve[2]);
  const double by_error = radius > 0 ? std::sqrt(bend / (8 * kChordError * radius)) : kMaxPieces;
  return static_cast<int>(std::clamp(std::ceil(std::max(by_error, turn / kPieceTurnRad)), 1.0,
                                     static_cast<double>(kMaxPieces)));
}

// A band across the curve, at right angles to normals that turn evenly from the first to the last
// of a segment.
TriangleMesh RibbonOf(const std::vector<Bezier>& segments, const std::vector<Double3>& normals,
                      double from_width, double to_width) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Double3 one = normals[i] * (1 / Length(normals[i]));
    const Double3 other = normals[i + 1] * (1 / Length(normals[i + 1]));
    const double angle = TurnBetween(one, other);
    const int pieces = std::max(PiecesOf(segments[i], std::max(from_width, to_width) / 2),
                                static_cast<int>(std::ceil(angle / kPieceTurnRad)));
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int piece = 0; piece <= pieces; ++piece) {
      const double t = static_cast<double>(piece) / pieces;
      const double u = (static_cast<double>(i) + t) / static_cast<double>(segments.size());
      Double3 normal = one;
      if (std::sin(angle) > 1e-9) {
        normal =
            (one * std::sin((1 - t) * angle) + other * std::sin(t * angle)) * (1 / std::sin(angle));
      }
      const Double3 tangent = Tangent(segments[i], t);
      Double3 across = Cross(normal, tangent);
      const double length = Length(across);
      if (length > 0) across = across * (1 / length);
      const Double3 facing = Cross(tangent, across);
      const double size = Length(facing);
      const double half = (from_width + (to_width - from_width) * u) / 2;
      for (const double side : {-1.0, 1.0}) {
        mesh.positions.push_back(ToFloat(PointOn(segments[i], t) + across * (side * half)));
        mesh.normals.push_back(size > 0 ? ToFloat(facing * (1 / size)) : Vec3());
        mesh.uvs.push_back({static_cast<float>(u), side < 0 ? 0.0F : 1.0F});
      }
    }
    for (int piece = 0; piece < pieces; ++piece) {
      const std::uint32_t a = first + 2 * static_cast<std::uint32_t>(piece);
      mesh.indices.insert(mesh.indices.end(), {a, a + 1, a + 2, a + 1, a + 3, a + 2});
    }
  }
  return mesh;
}

}  // namespace

void ReadCurvePiece(const ShapeInput& input, ShapeSet& shapes) {
  ParameterList& parameters = input.parameters;
  const ShapePlacement& placement = input.placement;
  std::string type = parameters.String("type", "flat");
  if (type != "flat" && type != "cylinder" && type != "ribbon") {
    parameters.Warning("type", Concat("must be flat, cylinder or ribbon, not ", Quoted(type),
                                      "; it is read as cylinder, as by pbrt-v4"));
    type = "cylinder";
  }
  const double width = parameters.Float("width", 1, kZeroOrMore);
  const double from_width = parameters.Float("width0", width, kZeroOrMore);
  const double to_width = parameters.Float("width1", width, kZeroOrMore);
  for (const std::string_view name : {"splitdepth", "edgelength"})
    parameters.Ignore(name);
  const std::span<const double> points = parameters.Numbers("P", kPointTypes, 3);
  const std::span<const double> given_normals = parameters.Numbers("N", kNormalTypes, 3);
  if (points.empty()) {
    if (!parameters.Has("P")) parameters.Error("needs control points: \"point3 P\" [ ... ]");
    return;
  }
  const std::vector<Bezier> segments = SegmentsOf(parameters, points);
  if (segments.empty()) return;
  // Before they take the memory.
  const std::uint64_t most = std::uint64_t{kMaxPieces} * sizeof(CurvePiece) * segments.size();
  if (most > input.assets.limits().max_shape_bytes) {
    parameters.Error("P", Concat("makes ", segments.size(),
                                 " segments, which are more than the memory for shapes holds"));
    return;
  }
  if (!(from_width > 0) && !(to_width > 0)) {
    parameters.diagnostics().Note(parameters.location(),
                                  Concat(parameters.subject(), " has no width and is left out"));
    return;
  }
  if (type == "ribbon") {
    std::vector<Double3> normals;
    for (std::size_t i = 0; i + 2 < given_normals.size(); i += 3)
      normals.push_back({given_normals[i], given_normals[i + 1], given_normals[i + 2]});
    if (normals.size() != segments.size() + 1) {
      parameters.Error("N", Concat("must have a normal for each end of a segment (",
                                   segments.size() + 1, "), not ", normals.size()));
      return;
    }
    if (std::ranges::any_of(normals, [](Double3 n) { return !(Length(n) > 0); })) {
      parameters.Error("N", "has a normal of length 0");
      return;
    }
    PlaceMesh(RibbonOf(segments, normals, from_width, to_width), parameters, placement, shapes);
    return;
  }
  if (placement.traits.area_light != kNoAreaLight || placement.emits) {
    parameters.Error("cannot emit light, in pbrt-v4 neither");
    return;
  }
  if (IsFlattened(parameters, placement.to_world)) return;
  const double scale = MeanScale(placement.to_world);
  const auto count = static_cast<double>(segments.size());
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const auto width_at = [&](double u) { return from_width + (to_width - from_width) * u; };
    const double largest = std::max(width_at(static_cast<double>(i) / count),
                                    width_at((static_cast<double>(i) + 1) / count)) /
                           2;
    const int pieces = PiecesOf(segments[i], largest);
    for (int k = 0; k < pieces; ++k) {
      CurvePiece piece;
      const auto end = [&](int number, Vec3& point, float& radius, float& u) {
        const double t = static_cast<double>(number) / pieces;
        const double at = (static_cast<double>(i) + t) / count;
        point = placement.to_world.Point(ToFloat(PointOn(segments[i], t)));
        radius = static_cast<float>(width_at(at) / 2 * scale);
        u = static_cast<float>(at);
      };
      end(k, piece.from, piece.from_radius, piece.from_u);
      end(k + 1, piece.to, piece.to_radius, piece.to_u);
      piece.center = piece.from * 0.5F + piece.to * 0.5F;
      piece.traits = placement.traits;
      if (!IsFinite(piece.from) || !IsFinite(piece.to) || !IsInRange(piece.center, piece.Reach())) {
        parameters.Error("is moved or scaled out of single precision by its transform");
        return;
      }
      shapes.curve_pieces.push_back(piece);
    }
  }
}

}  // namespace lucerna
