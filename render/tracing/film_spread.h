// For which pixels does a bright light count that an eye path met at once?
//
// A pixel's eye paths begin where its filter says. Where the filter is weak they begin seldom, and
// a small bright light there would be a speck in one pass of a thousand. But the paths of the
// pixels around begin there often. So what a camera's ray finds of a light without a rough surface
// between counts for every pixel p whose filter h_p reaches the path's place f on the film, with
// the weight h_p(f) / Σ_q p_q(f), where p_q is the density with which the path of pixel q begins
// at f: the balance heuristic (Veach & Guibas 1995, section 3.2) over the pixels. It is applied to
// what exceeds a constant of the pixel, the radiance c_p straight ahead of its centre, because the
// weights sum to 1 in the mean only: the inside of a light stays without noise.
//
//   I_p = c_p + Σ_q (L(f_q) - c_p) h_p(f_q) / Σ_s p_s(f_q)
//
// Where the outline of such a light is near, a path meets it or does not, and one path a pass would
// leave a pixel that has a thousandth of the light black in most passes. There
// kMostBrightPaths paths a pixel are traced for the bright part alone, in place of the pixel's own
// path, each with as much less weight.
//
// A light seen by way of smooth surfaces may be far smaller than a pixel. Around such images (see
// glints.h) n_g paths a pass are drawn with a density p_g each, which counts in the balance
// heuristic with all others: the weight is h_p(f) / (Σ_s p_s(f) + Σ_g n_g p_g(f)), of the lens'
// given point, which all draw alike.
//
// Only what is brighter than the image's white is treated so (EyePath::bright): a sky gains
// nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "render/base/parallel.h"
#include "render/math/rgb.h"
#include "render/tracing/eye_path.h"
#include "render/tracing/glints.h"

namespace lucerna {

// As many where outlines are in few pixels: all together are at most a sixteenth as many as pixels,
// but for large shapes that are given by a formula.
inline constexpr int kMostBrightPaths = 16;
inline constexpr double kBrightPathsAPixel = 1.0 / 16;

class FilmSpread {
 public:
  // Keeps a reference to the tracer.
  explicit FilmSpread(const EyePathTracer& tracer);
  // With these in place of the glints that would be found. The mean over passes is the same.
  FilmSpread(const EyePathTracer& tracer, Glints glints);

  // Whether Add does anything.
  [[nodiscard]] bool is_needed() const { return tracer_.MeetsBright(); }

  // Finds what does not change between passes, unless it is known; Add does so too. Where colours
  // of the scene change between passes it is to be called before.
  void Prepare(ThreadTeam& team);

  // Adds to `direct` what bright lights bring to the pixels of the crop window in a pass. `bright`:
  // EyePath::bright of the same pixels. What lies straight ahead of pixels is found once.
  // `shall_stop` may be empty and is asked between tiles: once it is true, the rest is left out.
  void Add(std::uint64_t pass, const std::vector<Rgb>& bright, std::vector<Rgb>& direct,
           ThreadTeam& team, const std::function<bool()>& shall_stop = nullptr);

 private:
  // Pixels [x0, x1) × [y0, y1) in the crop window's coordinates.
  struct Window {
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  };
  // A path that was drawn around a glint.
  struct GlintPath {
    Rgb bright;
    int x = 0, y = 0;  // its pixel, in the crop window's coordinates
    EyePathTracer::FilmOffset from;
    std::size_t glint = 0;
  };
  // Of a glint, of all.
  [[nodiscard]] std::span<const GlintPath> PathsOf(const std::vector<GlintPath>& paths,
                                                   std::size_t glint) const {
    return std::span(paths).subspan(first_path_of_glint_[glint],
                                    first_path_of_glint_[glint + 1] - first_path_of_glint_[glint]);
  }
  // What the filters of the pixels reach.
  [[nodiscard]] FilmRegion OnFilm(const Window& pixels) const;
  [[nodiscard]] std::vector<GlintPath> TraceGlints(std::uint64_t pass, ThreadTeam& team) const;
  void AddTile(std::uint64_t pass, const Window& tile, const std::vector<Rgb>& bright,
               const std::vector<GlintPath>& glint_paths, std::vector<Rgb>& direct) const;
  // What lies straight ahead of a pixel in `around_`.
  [[nodiscard]] Rgb CentreAt(int x, int y) const;
  // Of a pixel in `around_`, for is_near_outline_.
  [[nodiscard]] std::size_t IndexOf(int x, int y) const {
    return static_cast<std::size_t>(y - around_.y0) *
               static_cast<std::size_t>(around_.x1 - around_.x0) +
           static_cast<std::size_t>(x - around_.x0);
  }
  // Paths a pass that are traced for the bright part alone; 0: the pixel's own path counts.
  [[nodiscard]] int BrightPathsOf(int x, int y) const;

  const EyePathTracer& tracer_;
  const int width_, height_;     // of the crop window
  const int reach_x_, reach_y_;  // how far a pixel may be whose paths count [pixels]
  const Window image_;           // in the crop window's coordinates
  bool is_prepared_ = false;
  // The crop window and the pixels around it whose paths count.
  Window around_;
  // [tiles of around][pixels of a tile], row by row; those of a tile empty: all black, as in most
  // of an image.
  std::vector<std::vector<Rgb>> centres_;
  std::vector<std::uint8_t> is_near_outline_;  // [around], or empty: none is
  int bright_paths_ = 0;                       // near an outline
  bool finds_glints_ = true;
  Glints glints_;
  std::vector<std::size_t> first_path_of_glint_;  // [glints + 1]
};

}  // namespace lucerna
