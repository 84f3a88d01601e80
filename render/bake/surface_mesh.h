// A mesh that carries the irradiance of a scene's surfaces.
//
// Each shape on which photons are kept becomes one or two surfaces of triangles, one for each side
// that is measured. A surface has a vertex of its own at each corner of its faces where it bends by
// more than 30 degrees, and a common one elsewhere. Irradiance is measured at the vertices and
// linear between them; with quadratic elements, also in the middle of edges, and quadratic between
// the six points of a face.
//
// The mesh is refined where that is wrong: the irradiance is measured in the middle of an edge too
// (with quadratic elements, at its quarters), and where it differs from what the mesh has there by
// more than is allowed, the faces beside the edge are split. What lies between those points is not
// overlooked either when the mesh was surveyed: the mean of the mesh over each face of the first
// mesh must agree with the mean that was measured there. Faces are split at their longest edge
// first, whatever edge asks for it (Rivara 1984, "Algorithms for refining triangular grids suitable
// for adaptive and multigrid techniques"), so that they do not become thinner; and the two faces of
// an edge are split together, also where they are of different surfaces with corners at the same
// places: there are no cracks.
//
// Lengths and positions are those of the scene's file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "render/base/status.h"
#include "render/formats/sensors/sensors_reader.h"
#include "render/math/rgb.h"
#include "render/math/vector.h"
#include "render/scene/scene.h"

namespace lucerna {

// Of a sensor [W·m⁻²].
struct Irradiance {
  Rgb value;
  float noise = 0;   // standard deviation of the luminance
  float direct = 0;  // of the luminance, what comes straight from lights
};

struct MeshVertex {
  Vec3 position;
  Vec3 normal;              // unit, on the measured side
  Sensor sensor;            // beside the corner, on one of the faces
  std::uint32_t place = 0;  // equal for vertices at equal positions
  std::uint32_t surface = 0;
  std::optional<Irradiance> irradiance;  // absent: not measured yet
};

struct MeshFace {
  std::array<std::uint32_t, 3> vertices;  // counter-clockwise seen from the measured side
  std::uint32_t surface = 0;
  std::optional<Irradiance> bucket = std::nullopt;  // of a histogram
  std::uint32_t survey = 0;                         // of the face of the first mesh that it is in
};

// How irradiance is interpolated on a face.
enum class MeshElements : std::uint8_t { kLinear, kQuadratic };

// One side of one shape.
struct MeshSurface {
  std::string name;         // of its material; empty where the file gives none
  std::uint32_t shape = 0;  // a number of its own for each shape, from 0
  bool is_back = false;     // the side that the outward normal points away from
  bool is_kept = true;      // else it has no faces any more
  // A ball on which new vertices are placed.
  struct Ball {
    Vec3 center;
    float radius = 0;
  };
  std::optional<Ball> ball;
};

// "3 floor", "4 wall, back".
[[nodiscard]] std::string NameOf(const MeshSurface& surface);

// Which sides of each shape are kept.
enum class MeasuredSides : std::uint8_t { kBrighter, kFront, kBack, kBoth };

class SurfaceMesh {
 public:
  static constexpr std::size_t kMostFaces = std::size_t{1} << 24;
  struct Options {
    MeasuredSides sides = MeasuredSides::kBrighter;
    std::vector<std::string> names;  // of materials; empty: all
    double spacing = 0;              // of neighbouring points where the mesh is finest, > 0
    MeshElements elements = MeshElements::kLinear;
    std::size_t max_faces = kMostFaces;
  };
  // Shapes of other materials than those that keep photons, and curves, have no part in it.
  // Errors: NOT_FOUND when nothing is left, with the names that there are.
  [[nodiscard]] static StatusOr<SurfaceMesh> FromScene(const Scene& scene, const Options& options);

  // Splits edges until none is longer.
  // Errors: RESOURCE_EXHAUSTED once there are more than max_faces.
  [[nodiscard]] Status SplitLongEdges(double longest);
  // Whether so many are enough by the area alone, which takes no time. Errors: the same.
  [[nodiscard]] Status CheckLongEdges(double longest) const;

  // Where irradiance is to be measured next: at vertices that have none, then, with `with_edges`,
  // in the middle of all edges that are longer than the spacing and were not measured before, and
  // with quadratic elements at the quarters of those longer than twice the spacing.
  [[nodiscard]] std::vector<Sensor> NextSensors(bool with_edges);
  // Takes what was measured at the sensors that were asked for last, in their order.
  void SetMeasured(const std::vector<Irradiance>& measured);

  // For histograms, in place of sensors at vertices: one in the middle of each face, whose spacing
  // reaches its corners and whose bucket is the face; and the faces' borders.
  [[nodiscard]] SensorSet Buckets() const;
  // [faces] of their sensors.
  void SetBuckets(const std::vector<Irradiance>& measured);
  // Takes what was measured in buckets as means over the faces of the first mesh, which Refine
  // compares with, and the faces have no buckets any more. Before faces are split.
  void KeepAsSurvey();

  // Of each shape with two sides, drops the one that receives less. Once, after buckets were
  // measured.
  void DropDarkerSides();

  // Splits the edges where irradiance, as it was measured last, differs from that of the mesh by
  // more than `tolerance` times the luminance there, or a tenth of the mean where that is more, and
  // by more than twice the standard deviation of the difference; and the edges within a face of the
  // first mesh over which the mesh's mean differs from the surveyed one by more than that and its
  // noise, or lacks direct light by half. With a tolerance of 0: all of them. Returns how many.
  // Errors: RESOURCE_EXHAUSTED as before.
  [[nodiscard]] StatusOr<std::size_t> Refine(double tolerance);

  // Removes vertices where the mesh is flat and linear without them: nowhere does the mesh differ
  // afterwards from what was measured by more than `tolerance`, as above. No edge becomes longer
  // than `longest`. Last, of linear elements. Returns how many.
  std::size_t Decimate(double tolerance, double longest);

  // Root of the mean squared difference between irradiance that was measured, but at no vertex or
  // node of the mesh, and that of the mesh, over the mean luminance; noise included. Each point
  // counts by the square of its edge's length. 0 when there are none.
  [[nodiscard]] double InterpolationError() const;

  // Of the middle of an edge of quadratic elements, by its ends: where it is and what was measured,
  // or, on edges that are not measured, the mean of its ends.
  [[nodiscard]] MeshVertex NodeOf(const MeshFace& face, std::uint32_t from, std::uint32_t to) const;
  [[nodiscard]] MeshElements elements() const { return elements_; }

  [[nodiscard]] const std::vector<MeshVertex>& vertices() const { return vertices_; }
  [[nodiscard]] const std::vector<MeshFace>& faces() const { return faces_; }
  [[nodiscard]] const std::vector<MeshSurface>& surfaces() const { return surfaces_; }
  [[nodiscard]] double AreaOf(const MeshFace& face) const;
  // A sensor near `position`, which is in or on the edge of the face; on the ball of its surface.
  [[nodiscard]] Sensor SensorOn(const MeshFace& face, Vec3 position, Vec3 normal) const;
  // Of the luminance over the area; 0 of an empty mesh.
  [[nodiscard]] double MeanIrradiance() const;

 private:
  // Two numbers in order.
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  // Points of an edge that are no vertices.
  struct Probe {
    MeshVertex middle;
    // Between the middle and the first end, and the second; of quadratic elements.
    std::optional<std::array<MeshVertex, 2>> quarters;
    bool is_used = false;  // the middle became a vertex
  };
  struct AskedProbe {
    Pair edge;
    int point = 0;  // 0 the middle, 1 and 2 the quarters
  };
  // A face of the first mesh.
  struct Survey {
    Irradiance mean;
    bool is_flat = true;
  };
  // What was measured and is neither a vertex nor a probe of an edge that there is.
  struct Remainder {
    double difference = 0, weight = 0;
  };

  SurfaceMesh() = default;
  std::uint32_t PlaceOf(Vec3 position);
  void AddSurface(const std::vector<Vec3>& positions,
                  const std::vector<std::array<std::uint32_t, 3>>& triangles, MeshSurface surface);
  [[nodiscard]] Pair EdgeOf(const MeshFace& face, int edge) const;
  [[nodiscard]] Pair PlacesOf(Pair edge) const;
  [[nodiscard]] double LengthOf(Pair edge) const;
  [[nodiscard]] int LongestEdgeOf(const MeshFace& face) const;
  [[nodiscard]] MeshVertex MiddleOf(const MeshFace& face, const MeshVertex& a,
                                    const MeshVertex& b) const;
  [[nodiscard]] MeshVertex& PointOf(const AskedProbe& asked);
  // Of what the mesh has on a face, of the luminance, and of its direct part.
  struct FaceMean {
    double all = 0, direct = 0;
  };
  [[nodiscard]] FaceMean MeanOn(const MeshFace& face) const;
  // Of faces of the first mesh whose mean is not that of the survey.
  void AddUnlikeSurvey(double tolerance, double floor, std::set<Pair>& places) const;
  [[nodiscard]] Irradiance AtCorner(const MeshFace& face, std::uint32_t vertex) const {
    return face.bucket ? *face.bucket : *vertices_[vertex].irradiance;
  }
  // Splits the faces beside edges between these places, and what must be split with them.
  [[nodiscard]] Status Split(std::set<Pair> places);

  double spacing_ = 0;
  std::size_t max_faces_ = kMostFaces;
  MeshElements elements_ = MeshElements::kLinear;
  std::vector<MeshVertex> vertices_;
  std::vector<MeshFace> faces_;
  std::vector<MeshSurface> surfaces_;
  std::map<std::array<float, 3>, std::uint32_t> places_;
  std::map<Pair, Probe> probes_;  // by the vertices of the edge
  // What NextSensors asked for: vertices, then points of edges.
  std::vector<std::uint32_t> asked_vertices_;
  std::vector<AskedProbe> asked_probes_;
  std::vector<Survey> surveys_;                       // empty: none
  std::optional<std::vector<Remainder>> remainders_;  // once it is decimated
};

}  // namespace lucerna
