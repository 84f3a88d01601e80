#include "render/tracing/glints.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numbers>
#include <utility>

#include "render/math/double3.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Glints are searched, and paths are shared out, by squares of the film of so many pixels: a crop
// window has the glints of the whole image.
constexpr int kGlintTile = 16;
// Reflections and refractions of a chain, at most. What light is left after more is mostly below
// the image's white.
constexpr int kMostHits = 8;
// Chains from one place of the film that are searched, at most.
constexpr std::size_t kMostChains = 64;
// Of the smallest ellipse that holds the light's image where the film is mapped linearly to the
// light's place. More holds curved images better, less is hit more often.
constexpr double kMargin = 1.75;
// A larger image is met often enough by the pixels' own paths, but for few pixels at its rim
// [pixel²].
constexpr double kLargestArea = 4;
// With a lens the ellipse is larger by what its middle misses the image's [the image's radii], up
// to this; so many times more paths are drawn for that, at most.
constexpr double kLargestBend = 8;
constexpr double kMostForBend = 4;
// What reaches farther, over all points of the lens, is left out [pixels].
constexpr double kFarthestReach = 8;
// Paths in a pass: of a glint, where the tile has enough, and for each pixel² of a large one; of a
// tile, at most, a quarter of its pixels.
constexpr double kPathsOfGlint = 8;
constexpr double kPathsAPixel = 16;
constexpr std::size_t kPathsOfTile = 64;
// Lights that are searched, at most, those of most power.
constexpr std::size_t kMostEmitters = 64;
// The smallest cell of the film that a search looks at [pixels], and how often cells are split in a
// tile, at most: each split traces five corners, so that the whole search traces no more than five
// times as many as the tile has pixels.
constexpr double kSmallestCell = 1.0 / 8;
constexpr int kMostSplits = 200;
// Cells are split where directions at their corners differ by more [cosine of the angle].
constexpr double kStraight = 0.9;
// Walks in a tile, at most, and steps of each.
constexpr int kMostWalks = 128;
constexpr int kNewtonSteps = 12;

constexpr std::uint64_t kGlintKey = 0x474C494E54530000ULL;

using FilmPoint = Glint::FilmPoint;
using Matrix = Glint::Matrix;

FilmPoint operator*(const Matrix& m, FilmPoint p) {
  return {m.xx * p.x + m.xy * p.y, m.yx * p.x + m.yy * p.y};
}
Matrix operator*(const Matrix& a, const Matrix& b) {
  return {a.xx * b.xx + a.xy * b.yx, a.xx * b.xy + a.xy * b.yy, a.yx * b.xx + a.yy * b.yx,
          a.yx * b.xy + a.yy * b.yy};
}
FilmPoint operator+(FilmPoint a, FilmPoint b) {
  return {a.x + b.x, a.y + b.y};
}
FilmPoint operator-(FilmPoint a, FilmPoint b) {
  return {a.x - b.x, a.y - b.y};
}
FilmPoint operator*(FilmPoint a, double s) {
  return {a.x * s, a.y * s};
}
Matrix operator*(const Matrix& m, double s) {
  return {m.xx * s, m.xy * s, m.yx * s, m.yy * s};
}
// Requires a determinant other than 0.
Matrix Inverse(const Matrix& m) {
  return Matrix{m.yy, -m.xy, -m.yx, m.xx} * (1 / m.Determinant());
}
bool IsFinite(const Matrix& m) {
  return std::isfinite(m.xx) && std::isfinite(m.xy) && std::isfinite(m.yx) && std::isfinite(m.yy);
}
// Half of the width and height of the ellipse that the unit disc becomes.
FilmPoint HalfExtentOf(const Matrix& m) {
  return {std::hypot(m.xx, m.xy), std::hypot(m.yx, m.yy)};
}

// A ball that holds a light.
struct Ball {
  Double3 center;
  double radius = 0;
  Rgb radiance;
};

// Reflections and refractions from the camera on, and the ray that leaves the last.
struct Chain {
  std::uint32_t refractions = 0;  // bit i: the chain refracts at hit i
  int hits = 0;
  std::uint64_t surfaces = 0;  // key of the surfaces in order
  Rgb weight;
  Ray last;

  [[nodiscard]] bool IsLike(const Chain& other) const {
    return refractions == other.refractions && hits == other.hits && surfaces == other.surfaces;
  }
};
using Chains = std::vector<Chain>;

// The key of a chain's surfaces with another one behind: each analytic shape has its own, all
// triangles of a mesh have one.
std::uint64_t WithSurface(std::uint64_t surfaces, const Scene& scene, const SurfacePoint& surface) {
  const std::uint64_t part =
      MeshOf(scene, surface.geometry) == nullptr ? surface.primitive : surface.instance;
  return CombineKeys(CombineKeys(surfaces, surface.geometry), part);
}

// Bright lights with their own extent; none if they cannot be seen by way of smooth surfaces.
std::vector<Ball> SearchedLights(const EyePathTracer& tracer) {
  const Scene& scene = tracer.scene();
  std::vector<Ball> balls;
  if (!tracer.MeetsBright() || std::ranges::none_of(scene.materials, ScattersSmoothly))
    return balls;
  const auto radiance_of = [&](const ShapeTraits& traits) {
    if (traits.area_light == kNoAreaLight) return Rgb{};
    return scene.area_lights[static_cast<std::size_t>(traits.area_light)].Largest();
  };
  for (const TriangleMesh& mesh : scene.meshes) {
    const Rgb radiance = radiance_of(mesh.traits);
    if (!tracer.IsBright(radiance)) continue;
    Bounds bounds;
    for (const std::uint32_t corner : mesh.indices)
      bounds.Add(mesh.positions[corner]);
    if (bounds.empty()) continue;
    Ball ball = {(Double3(bounds.low) + Double3(bounds.high)) * 0.5, 0, radiance};
    for (const std::uint32_t corner : mesh.indices) {
      ball.radius = std::max(ball.radius, Length(Double3(mesh.positions[corner]) - ball.center));
    }
    balls.push_back(ball);
  }
  ForEachAnalyticShape(scene, [&](const auto& shape) {
    const Rgb radiance = radiance_of(shape.traits);
    if (!tracer.IsBright(radiance)) return;
    balls.push_back({Double3(shape.center), static_cast<double>(shape.Reach()), radiance});
  });
  const auto power = [](const Ball& ball) {
    return static_cast<double>(MaxChannel(ball.radiance)) * ball.radius * ball.radius;
  };
  std::ranges::stable_sort(balls, std::ranges::greater(), power);
  balls.resize(std::min(balls.size(), kMostEmitters));
  return balls;
}

// The plane through a light's centre across the direction from which it is seen.
struct Target {
  Double3 center, normal, x, y;

  Target(const Ball& light, Double3 from) : center(light.center) {
    normal = light.center - from;
    normal = normal * (1 / Length(normal));
    const Double3 aside = std::abs(normal.x) < 0.5 ? Double3(1, 0, 0) : Double3(0, 1, 0);
    x = Cross(aside, normal);
    x = x * (1 / Length(x));
    y = Cross(normal, x);
  }
  // Where the ray meets the plane, from the light's centre; absent for rays that hardly approach.
  [[nodiscard]] std::optional<FilmPoint> Meets(const Ray& ray) const {
    const Double3 direction(ray.direction);
    const double approach = Dot(direction, normal);
    if (!(approach > 0.1)) return std::nullopt;
    const Double3 from = Double3(ray.origin) - center;
    const Double3 at = from - direction * (Dot(from, normal) / approach);
    return FilmPoint{Dot(at, x), Dot(at, y)};
  }
};

// The search in one tile of the film.
class TileSearch {
 public:
  TileSearch(const EyePathTracer& tracer, const std::vector<Ball>& lights, int tile_x, int tile_y)
      : tracer_(tracer), lights_(lights), x0_(tile_x * kGlintTile), y0_(tile_y * kGlintTile) {
    for (const Ball& light : lights)
      brightest_ = std::max(brightest_, MaxChannel(light.radiance));
  }

  // Found glints, with keys that follow from `key`.
  [[nodiscard]] std::vector<Glint> Run(std::uint64_t key) {
    constexpr std::size_t kCorners = kGlintTile + 1;
    std::vector<Chains> corners(kCorners * kCorners);
    bool is_any = false;
    for (std::size_t y = 0; y < kCorners; ++y) {
      for (std::size_t x = 0; x < kCorners; ++x) {
        corners[y * kCorners + x] =
            ChainsAt({x0_ + static_cast<double>(x), y0_ + static_cast<double>(y)});
        is_any = is_any || !corners[y * kCorners + x].empty();
      }
    }
    if (!is_any) return {};
    // Whole cells first, then parts of those that are uncertain, the largest first.
    std::deque<Cell> uncertain;
    for (std::size_t y = 0; y < kGlintTile; ++y) {
      for (std::size_t x = 0; x < kGlintTile; ++x) {
        const Chains* first = &corners[y * kCorners + x];
        const Cell cell = {{x0_ + static_cast<double>(x), y0_ + static_cast<double>(y)},
                           1,
                           {first, first + 1, first + kCorners, first + kCorners + 1}};
        if (!SearchCell(cell)) uncertain.push_back(cell);
      }
    }
    for (int splits = 0; splits < kMostSplits && !uncertain.empty(); ++splits) {
      const Cell cell = uncertain.front();
      uncertain.pop_front();
      if (0.5 * cell.size < kSmallestCell) break;
      Split(cell, uncertain);
    }
    return Shared(key);
  }

 private:
  struct Cell {
    FilmPoint corner;                      // of least x and y
    double size = 1;                       // [pixels]
    std::array<const Chains*, 4> corners;  // in rows
  };
  struct Found {
    Glint glint;
    Chain chain;
    const Ball* light = nullptr;
    double area = 0;      // of the light's image [pixel²]
    double strength = 0;  // radiance
  };

  // The chains at a place of the film that leave enough of the brightest light, short ones first.
  [[nodiscard]] Chains ChainsAt(FilmPoint place) const {
    Chains chains;
    const auto add_after = [&](const Chain& chain) {
      SurfacePoint surface;
      if (chain.hits >= MostHits() || !MeetsSmooth(chain.last, surface)) return;
      const auto branches = tracer_.SmoothBranches(surface, -chain.last.direction);
      for (std::uint32_t lobe = 0; lobe < EyePathTracer::kSmoothLobes; ++lobe) {
        if (!branches[lobe].exists) continue;
        const Chain next = After(chain, surface, branches[lobe], lobe);
        if (tracer_.IsBright(next.weight * brightest_)) chains.push_back(next);
      }
    };
    Chain start;
    start.weight = Gray(1);
    start.last = tracer_.CameraRayThrough(place.x, place.y, {});
    add_after(start);
    for (std::size_t i = 0; i < chains.size() && chains.size() < kMostChains; ++i)
      add_after(Chain(chains[i]));
    return chains;
  }

  // The chain like `like` at a place of the film and the lens.
  [[nodiscard]] std::optional<Ray> Follow(FilmPoint place, Vec3 on_lens, const Chain& like) const {
    Chain chain;
    chain.last = tracer_.CameraRayThrough(place.x, place.y, on_lens);
    while (chain.hits < like.hits) {
      SurfacePoint surface;
      if (!MeetsSmooth(chain.last, surface)) return std::nullopt;
      const std::uint32_t lobe = like.refractions >> chain.hits & 1U;
      const auto branches = tracer_.SmoothBranches(surface, -chain.last.direction);
      if (!branches[lobe].exists) return std::nullopt;
      chain = After(chain, surface, branches[lobe], lobe);
    }
    if (!chain.IsLike(like)) return std::nullopt;
    return chain.last;
  }

  [[nodiscard]] int MostHits() const { return std::min(kMostHits, tracer_.settings().max_depth); }

  [[nodiscard]] bool MeetsSmooth(const Ray& ray, SurfacePoint& surface) const {
    Hit hit;
    if (!tracer_.intersector().Intersect(ray, hit)) return false;
    surface = tracer_.intersector().SurfaceAt(ray, hit);
    return tracer_.ScattersSmoothly(surface);
  }

  [[nodiscard]] Chain After(const Chain& chain, const SurfacePoint& surface,
                            const EyePathTracer::SmoothBranch& branch, std::uint32_t lobe) const {
    Chain next;
    next.refractions = chain.refractions | lobe << chain.hits;
    next.hits = chain.hits + 1;
    next.surfaces = WithSurface(chain.surfaces, tracer_.scene(), surface);
    next.weight = chain.weight * branch.weight * branch.share;
    next.last = {LeavingPoint(surface, branch.wi), branch.wi, HUGE_VALF};
    return next;
  }

  // Searches both triangles of a cell for each chain that their corners have. False where chains
  // differ between the corners, or are bent.
  bool SearchCell(const Cell& cell) {
    const auto& corners = cell.corners;
    bool is_certain = true;
    for (std::size_t i = 1; i < 4; ++i)
      is_certain = is_certain && corners[i]->size() == corners[0]->size();
    const auto like = [](const Chains& chains, const Chain& chain) -> const Chain* {
      const auto at = std::ranges::find_if(chains, [&](const Chain& c) { return c.IsLike(chain); });
      return at == chains.end() ? nullptr : &*at;
    };
    // The diagonal belongs to both triangles, so that each chain of a whole triangle is at one of
    // its ends.
    for (const Chain& chain : *corners[0]) {
      const Chain* at[4] = {&chain, like(*corners[1], chain), like(*corners[2], chain),
                            like(*corners[3], chain)};
      for (int i = 1; i < 4; ++i) {
        is_certain =
            is_certain && at[i] != nullptr &&
            static_cast<double>(Dot(at[i]->last.direction, chain.last.direction)) > kStraight;
      }
      if (at[3] == nullptr) continue;
      const FilmPoint diagonal = {cell.size, cell.size};
      for (const Ball& light : lights_) {
        if (!tracer_.IsBright(chain.weight * light.radiance)) continue;
        if (at[1] != nullptr)
          SearchTriangle(cell, *at[0], *at[1], *at[3], {cell.size, 0}, diagonal, light);
        if (at[2] != nullptr)
          SearchTriangle(cell, *at[0], *at[2], *at[3], {0, cell.size}, diagonal, light);
      }
    }
    return is_certain;
  }

  void SearchTriangle(const Cell& cell, const Chain& a, const Chain& b, const Chain& c,
                      FilmPoint to_b, FilmPoint to_c, const Ball& light) {
    // Room around the triangle for what its three rays do not show, in its sides.
    constexpr double kRoom = 0.25;
    const Double3 from(a.last.origin);
    if (!(Length(light.center - from) > light.radius)) return;
    const Target target(light, from);
    const std::optional<FilmPoint> at_a = target.Meets(a.last);
    if (!at_a) return;
    const std::optional<FilmPoint> at_b = target.Meets(b.last);
    const std::optional<FilmPoint> at_c = target.Meets(c.last);
    if (!at_b || !at_c) return;
    const FilmPoint ab = *at_b - *at_a;
    const FilmPoint ac = *at_c - *at_a;
    const Matrix sides = {ab.x, ac.x, ab.y, ac.y};
    if (sides.Determinant() == 0) return;
    const FilmPoint share = Inverse(sides) * FilmPoint{-at_a->x, -at_a->y};
    if (!(share.x >= -kRoom && share.y >= -kRoom && share.x + share.y <= 1 + kRoom)) return;
    Refine(cell.corner + to_b * share.x + to_c * share.y, 0.25 * cell.size, a, light);
  }

  // Cuts a cell in four and adds those of them that are uncertain.
  void Split(const Cell& cell, std::deque<Cell>& uncertain) {
    const double half = 0.5 * cell.size;
    const auto& c = cell.corners;
    std::array<const Chains*, 9> at = {c[0],    nullptr, c[1],    nullptr, nullptr,
                                       nullptr, c[2],    nullptr, c[3]};
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (at[i] != nullptr) continue;
      const FilmPoint aside = {half * static_cast<double>(i % 3),
                               half * static_cast<double>(i / 3)};
      at[i] = &chains_of_parts_.emplace_back(ChainsAt(cell.corner + aside));
    }
    for (std::size_t y = 0; y < 2; ++y) {
      for (std::size_t x = 0; x < 2; ++x) {
        const std::size_t i = 3 * y + x;
        const FilmPoint aside = {half * static_cast<double>(x), half * static_cast<double>(y)};
        const Cell part = {cell.corner + aside, half, {at[i], at[i + 1], at[i + 3], at[i + 4]}};
        if (!SearchCell(part)) uncertain.push_back(part);
      }
    }
  }

  // Walks by Newton's method from `place` to where the chain leads to the middle of the light: a
  // walk on the manifold of specular paths (Jakob & Marschner 2012, section 4) in the film's
  // coordinates, with derivatives from differences. Keeps what it arrives at.
  void Refine(FilmPoint place, double step, const Chain& chain, const Ball& light) {
    if (walks_ == kMostWalks) return;
    ++walks_;
    std::optional<Ray> ray = Follow(place, {}, chain);
    for (int i = 0; ray && i < kNewtonSteps; ++i) {
      const Double3 from(ray->origin);
      if (!(Length(light.center - from) > light.radius)) return;
      const Target target(light, from);
      const std::optional<FilmPoint> miss = target.Meets(*ray);
      if (!miss) return;
      Matrix inverse;  // of the derivatives of `miss` by the film
      if (!InverseOfDerivatives(place, step, chain, target, *miss, inverse)) return;
      const FilmPoint move = inverse * FilmPoint{-miss->x, -miss->y};
      const Matrix image = inverse * light.radius;
      const FilmPoint half = HalfExtentOf(image);
      const double narrowest = std::abs(image.Determinant()) / std::max(half.x, half.y);
      if (std::hypot(miss->x, miss->y) < 0.1 * light.radius) {
        Keep(place + move, image, target, chain, light);
        return;
      }
      // A step that leaves the chain is halved.
      double share = std::min(1.0, 1 / std::hypot(move.x, move.y));
      const FilmPoint before = place;
      ray = std::nullopt;
      for (int halvings = 0; halvings < 4 && !ray; ++halvings, share *= 0.5) {
        place = before + move * share;
        ray = Follow(place, {}, chain);
      }
      step = std::clamp(0.25 * narrowest, 1e-4, step);
    }
  }

  [[nodiscard]] bool InverseOfDerivatives(FilmPoint place, double step, const Chain& chain,
                                          const Target& target, FilmPoint miss,
                                          Matrix& inverse) const {
    std::array<FilmPoint, 2> slope;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      bool is_known = false;
      for (const double side : {step, -step}) {
        const FilmPoint aside = place + (axis == 0 ? FilmPoint{side, 0} : FilmPoint{0, side});
        const std::optional<Ray> ray = Follow(aside, {}, chain);
        const std::optional<FilmPoint> at = ray ? target.Meets(*ray) : std::nullopt;
        if (!at) continue;
        slope[axis] = (*at - miss) * (1 / side);
        is_known = true;
        break;
      }
      if (!is_known) return false;
    }
    const Matrix derivatives = {slope[0].x, slope[1].x, slope[0].y, slope[1].y};
    if (derivatives.Determinant() == 0) return false;
    inverse = Inverse(derivatives);
    return IsFinite(inverse);
  }

  // Where the chain at a place meets the target, for a point of the lens [the light's radii].
  [[nodiscard]] std::optional<FilmPoint> MissAt(FilmPoint place, Vec3 on_lens, const Chain& chain,
                                                const Target& target, const Ball& light) const {
    const std::optional<Ray> ray = Follow(place, on_lens, chain);
    const std::optional<FilmPoint> miss = ray ? target.Meets(*ray) : std::nullopt;
    if (!miss) return std::nullopt;
    return *miss * (1 / light.radius);
  }

  // How far the image moves with the place on the lens, and by how many of its own radii it
  // misses that at the lens' rim.
  struct LensMove {
    Matrix from_lens;
    double bend = 0;
  };
  [[nodiscard]] LensMove MoveOf(FilmPoint place, const Matrix& image, const Chain& chain,
                                const Target& target, const Ball& light) const {
    LensMove move;
    if (!tracer_.has_lens()) return move;
    std::array<FilmPoint, 2> slope;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      constexpr float kStep = 0.5F;  // [lens radii]
      const Vec3 aside = axis == 0 ? Vec3{kStep, 0, 0} : Vec3{0, kStep, 0};
      const std::optional<FilmPoint> low = MissAt(place, -aside, chain, target, light);
      const std::optional<FilmPoint> high = MissAt(place, aside, chain, target, light);
      if (low && high) slope[axis] = (*low - *high) * (0.5 / static_cast<double>(kStep));
    }
    move.from_lens = image * Matrix{slope[0].x, slope[1].x, slope[0].y, slope[1].y};
    constexpr int kRimPoints = 8;
    for (int i = 0; i < kRimPoints; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRimPoints;
      const FilmPoint rim = {std::cos(angle), std::sin(angle)};
      const Vec3 on_lens = {static_cast<float>(rim.x), static_cast<float>(rim.y), 0};
      const std::optional<FilmPoint> miss =
          MissAt(place + move.from_lens * rim, on_lens, chain, target, light);
      if (miss) move.bend = std::max(move.bend, std::hypot(miss->x, miss->y));
    }
    return move;
  }

  // Whether the camera sees the light by the chain, at its middle or halfway to its rim.
  [[nodiscard]] bool IsSeen(FilmPoint place, const Matrix& image, const Chain& chain) const {
    for (const FilmPoint aside : {FilmPoint{0, 0}, {0.5, 0}, {-0.5, 0}, {0, 0.5}, {0, -0.5}}) {
      const std::optional<Ray> ray = Follow(place + image * aside, {}, chain);
      Hit hit;
      if (!ray || !tracer_.intersector().Intersect(*ray, hit)) continue;
      const SurfacePoint surface = tracer_.intersector().SurfaceAt(*ray, hit);
      if (tracer_.IsBright(chain.weight *
                           tracer_.lights().EmittedRadiance(surface, -ray->direction))) {
        return true;
      }
    }
    return false;
  }

  void Keep(FilmPoint place, const Matrix& image, const Target& target, const Chain& chain,
            const Ball& light) {
    // What lies in another tile is found from there.
    if (!(place.x >= x0_ && place.x < x0_ + kGlintTile && place.y >= y0_ &&
          place.y < y0_ + kGlintTile))
      return;
    Found found;
    found.area = std::numbers::pi * std::abs(image.Determinant());
    if (!(found.area > 0) || found.area > kLargestArea) return;
    found.glint.middle = place;
    const LensMove move = MoveOf(place, image, chain, target, light);
    if (!(move.bend <= kLargestBend)) return;
    found.glint.axes = image * (kMargin + move.bend);
    found.glint.from_lens = move.from_lens;
    found.strength = static_cast<double>(MaxChannel(chain.weight * light.radiance));
    const FilmPoint half = found.glint.HalfExtent();
    if (!(half.x <= kFarthestReach && half.y <= kFarthestReach)) return;
    found.chain = chain;
    found.light = &light;
    for (const Found& other : found_) {
      // Two cells have found the same.
      if (other.light == &light && other.chain.IsLike(chain) &&
          other.glint.Density(place, {}) > 0) {
        return;
      }
    }
    if (!IsSeen(place, image, chain)) return;
    found_.push_back(found);
  }

  // What was found, with its share of the tile's paths; if there is too much, what is noisiest
  // without paths of its own.
  [[nodiscard]] std::vector<Glint> Shared(std::uint64_t key) {
    const auto variance = [](const Found& found) {
      return found.strength * found.strength * found.area;
    };
    std::ranges::stable_sort(found_, std::ranges::greater(), variance);
    found_.resize(std::min(found_.size(), kPathsOfTile));
    std::vector<Glint> glints;
    double wanted = 0;
    for (const Found& found : found_) {
      const double area = 1 / found.glint.LargestDensity();
      const double usual_area = kMargin * kMargin * found.area;
      const double paths =
          std::max(kPathsOfGlint * std::min(area / usual_area, kMostForBend), kPathsAPixel * area);
      glints.push_back(found.glint);
      glints.back().key = CombineKeys(key, glints.size());
      glints.back().paths = static_cast<int>(std::min(paths, static_cast<double>(kPathsOfTile)));
      wanted += glints.back().paths;
    }
    const double share = std::min(1.0, static_cast<double>(kPathsOfTile) / wanted);
    for (Glint& glint : glints)
      glint.paths = std::max(1, static_cast<int>(glint.paths * share));
    return glints;
  }

  const EyePathTracer& tracer_;
  const std::vector<Ball>& lights_;
  const int x0_, y0_;
  float brightest_ = 0;
  int walks_ = 0;
  std::deque<Chains> chains_of_parts_;
  std::vector<Found> found_;
};

}  // namespace

FilmPoint Glint::Sample(float u, float v, Vec3 on_lens) const {
  const Vec3 disc = SquareToDisk(u, v);
  return middle + axes * FilmPoint{static_cast<double>(disc.x), static_cast<double>(disc.y)} +
         from_lens * FilmPoint{static_cast<double>(on_lens.x), static_cast<double>(on_lens.y)};
}

double Glint::Density(FilmPoint place, Vec3 on_lens) const {
  const FilmPoint from_middle =
      place - middle -
      from_lens * FilmPoint{static_cast<double>(on_lens.x), static_cast<double>(on_lens.y)};
  const FilmPoint disc = Inverse(axes) * from_middle;
  if (!(disc.x * disc.x + disc.y * disc.y <= 1)) return 0;
  return LargestDensity();
}

double Glint::LargestDensity() const {
  return 1 / (std::numbers::pi * std::abs(axes.Determinant()));
}

FilmPoint Glint::HalfExtent() const {
  return HalfExtentOf(axes) + HalfExtentOf(from_lens);
}

Glints::Glints(const EyePathTracer& tracer, const FilmRegion& region, ThreadTeam& team) {
  const std::vector<Ball> lights = SearchedLights(tracer);
  if (lights.empty()) return;
  const RenderSettings& settings = tracer.settings();
  const Tiles whole = {0, 0, (settings.width - 1) / kGlintTile + 1,
                       (settings.height - 1) / kGlintTile + 1};
  tiles_ = TilesNear(region, whole);
  const auto columns = static_cast<std::size_t>(tiles_.x1 - tiles_.x0);
  const auto rows = static_cast<std::size_t>(tiles_.y1 - tiles_.y0);
  std::vector<std::vector<Glint>> of_tile(columns * rows);
  team.For(columns * rows, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t tile = begin; tile < end; ++tile) {
      const int x = tiles_.x0 + static_cast<int>(tile % columns);
      const int y = tiles_.y0 + static_cast<int>(tile / columns);
      const std::uint64_t key = CombineKeys(CombineKeys(kGlintKey, static_cast<std::uint64_t>(x)),
                                            static_cast<std::uint64_t>(y));
      of_tile[tile] = TileSearch(tracer, lights, x, y).Run(key);
    }
  });
  first_of_tile_.push_back(0);
  for (const std::vector<Glint>& glints : of_tile) {
    all_.insert(all_.end(), glints.begin(), glints.end());
    first_of_tile_.push_back(all_.size());
  }
}

Glints::Glints(std::vector<Glint> glints)
    : tiles_({0, 0, 1, 1}), all_(std::move(glints)), first_of_tile_({0, all_.size()}) {}

Glints::Tiles Glints::TilesNear(const FilmRegion& region, const Tiles& all) {
  const auto tile_of = [](double at, int low, int high) {
    return std::clamp(static_cast<int>(std::floor(at / kGlintTile)), low, high - 1);
  };
  return {tile_of(region.x0 - kFarthestReach, all.x0, all.x1),
          tile_of(region.y0 - kFarthestReach, all.y0, all.y1),
          tile_of(region.x1 + kFarthestReach, all.x0, all.x1) + 1,
          tile_of(region.y1 + kFarthestReach, all.y0, all.y1) + 1};
}

}  // namespace lucerna
