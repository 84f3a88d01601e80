// Hair keeps all light that it does not absorb, is what its papers say, and scatters by its own
// density; photons take the ways of eye paths back.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "gtest/gtest.h"

#include "render/geometry/intersector.h"
#include "render/math/rng.h"
#include "render/math/warp.h"
#include "render/transport/bsdf.h"
#include "render/transport/material_at.h"
#include "render/transport/working_space.h"
#include "tests/support/chi_square.h"
#include "tests/support/hair_reference.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

// theta: from the plane across the fibre. phi: around it, from the normal.
Vec3 Direction(double theta, double phi) {
  return {static_cast<float>(std::sin(theta)), static_cast<float>(std::cos(theta) * std::sin(phi)),
          static_cast<float>(std::cos(theta) * std::cos(phi))};
}

double SharedOut(const Material& hair, Vec3 wo, Vec3 wi, Carried carried) {
  return static_cast<double>(EvaluateBsdf(hair, wo, wi, carried).g) *
         static_cast<double>(std::abs(wi.z));
}

// Of a function of directions over the sphere, by midpoints. Around the fibre the functions are
// smooth and periodic, along it they are bells several cells wide: what such sums leave over is
// far below the roundings of float.
template <typename Function>
double OverSphere(const Function& function) {
  constexpr int kThetas = 700;
  constexpr int kPhis = 181;
  double sum = 0;
  for (int i = 0; i < kThetas; ++i) {
    const double theta = kPi64 * ((i + 0.5) / kThetas - 0.5);
    for (int k = 0; k < kPhis; ++k)
      sum += std::cos(theta) * function(Direction(theta, 2 * kPi64 * (k + 0.5) / kPhis));
  }
  return sum * kPi64 / kThetas * 2 * kPi64 / kPhis;
}

const std::array<std::array<double, 2>, 5> kViews = {
    {{0, 0}, {0.4, 0.9}, {-1.1, -0.5}, {1.3, 1.4}, {-0.2, -1.5}}};

// Roundings of float in a density of up to some hundred, and 2e-7 of the Bessel function.
constexpr double kRounding = 2e-4;

TEST(HairTest, KeepsAllLightInAWhiteFurnace) {
  for (const float beta_m : {0.1F, 0.3F, 1.0F}) {
    for (const float beta_n : {0.15F, 0.3F, 1.0F}) {
      for (const auto& [theta, phi] : kViews) {
        const Vec3 wo = Direction(theta, phi);
        const Material hair = HairMaterial(0, beta_m, beta_n);
        EXPECT_NEAR(
            OverSphere([&](Vec3 wi) { return SharedOut(hair, wo, wi, Carried::kRadiance); }), 1,
            kRounding)
            << beta_m << " " << beta_n << " " << theta << " " << phi;
      }
    }
  }
}

TEST(HairTest, DrawsByADensityThatIntegratesToOne) {
  for (const float beta : {0.15F, 0.3F, 0.8F}) {
    const Material hair = HairMaterial(0.6F, beta, beta);
    for (const auto& [theta, phi] : kViews) {
      const Vec3 wo = Direction(theta, phi);
      EXPECT_NEAR(OverSphere([&](Vec3 wi) { return static_cast<double>(PdfBsdf(hair, wo, wi)); }),
                  1, kRounding);
    }
  }
}

// With a scale tilt, too, which turns lobes and loses nothing.
TEST(HairTest, IsWhatThePapersSay) {
  KeyedRng rng(5);
  for (const float beta : {0.2F, 0.35F, 0.9F}) {
    Material hair = HairMaterial(0.4F, beta, beta + 0.05F);
    hair.absorption = {0.1F, 0.4F, 2};
    ReferenceFibre fibre;
    fibre.eta = static_cast<double>(hair.ior);
    fibre.beta_m = static_cast<double>(hair.beta_m);
    fibre.beta_n = static_cast<double>(hair.beta_n);
    fibre.tilt_rad = static_cast<double>(hair.scale_tilt);
    fibre.absorption = {static_cast<double>(0.1F), static_cast<double>(0.4F), 2};
    for (int i = 0; i < 2000; ++i) {
      const float a1 = rng.Uniform();
      const float a2 = rng.Uniform();
      const float b1 = rng.Uniform();
      const float b2 = rng.Uniform();
      Vec3 wo = SquareToSphere(a1, a2);
      wo.z = std::abs(wo.z);
      const Vec3 wi = SquareToSphere(b1, b2);
      // Near the fibre's own direction float leaves few digits of the angle around it.
      if (std::abs(wo.x) > 0.99F || std::abs(wi.x) > 0.99F || std::abs(wi.z) < 1e-3F) continue;
      const std::array<double, 3> expected = ReferenceHairShare(fibre, Double3(wo), Double3(wi));
      const Rgb f = EvaluateBsdf(hair, wo, wi, Carried::kRadiance);
      for (int c = 0; c < 3; ++c) {
        const double e = expected[static_cast<std::size_t>(c)];
        ASSERT_NEAR(static_cast<double>(f[c] * std::abs(wi.z)), e, 1e-3 * e + 1e-6);
      }
    }
  }
}

TEST(HairTest, SamplesByItsOwnDensity) {
  const std::vector<Material> materials = {HairMaterial(0, 0.3F, 0.3F), HairMaterial(2, 1, 0.4F)};
  const double level = SidakLevel(1e-3, static_cast<int>(materials.size() * kViews.size()));
  std::uint64_t key = 40;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    for (const auto& [theta, phi] : kViews) {
      const Vec3 wo = Direction(theta, phi);
      const double p_value = DirectionsPValue(
          [&](float u_lobe, float u1, float u2, Vec3& direction) {
            BsdfSample sample;
            if (!SampleBsdf(materials[m], wo, u_lobe, u1, u2, Carried::kRadiance, sample))
              return false;
            direction = sample.wi;
            return true;
          },
          [&](Vec3 wi) { return static_cast<double>(PdfBsdf(materials[m], wo, wi)); }, 100000,
          ++key);
      EXPECT_GT(p_value, level) << "material " << m << ", view " << theta << " " << phi;
    }
  }
}

TEST(HairTest, WeighsASampleByValueOverDensity) {
  KeyedRng rng(9);
  const Material hair = HairMaterial(0.5F, 0.3F, 0.4F);
  for (const auto& [theta, phi] : kViews) {
    const Vec3 wo = Direction(theta, phi);
    for (const Carried carried : {Carried::kRadiance, Carried::kFlux}) {
      for (int i = 0; i < 300; ++i) {
        const float u_lobe = rng.Uniform();
        const float u1 = rng.Uniform();
        const float u2 = rng.Uniform();
        BsdfSample sample;
        ASSERT_TRUE(SampleBsdf(hair, wo, u_lobe, u1, u2, carried, sample));
        ASSERT_NEAR(Length(sample.wi), 1, 1e-5);
        if (std::abs(sample.wi.z) < 1e-3F || std::abs(sample.wi.x) > 0.99F) continue;
        EXPECT_EQ(sample.pdf, PdfBsdf(hair, wo, sample.wi));
        const double share = SharedOut(hair, wo, sample.wi, carried);
        EXPECT_NEAR(share / static_cast<double>(sample.pdf * sample.weight.g), 1, 1e-4);
        EXPECT_FALSE(sample.is_delta);
      }
    }
  }
}

// Of light that meets a fibre anywhere across its width, photons bring from one direction to
// another what eye paths find there: the widths that both see differ by the cosines of theta.
TEST(HairTest, PhotonsAreTheAdjointOfEyePathsOverTheWidth) {
  const Material hair = HairMaterial(0.3F, 0.4F, 0.3F);
  ASSERT_GT(hair.scale_tilt, 0);
  constexpr int kOffsets = 2000;
  // What goes from one direction to the other, on average over where on the width the first one
  // meets the tube: the normal turns, the directions stay.
  const auto mean = [&](double theta_first, double theta_second, double phi, Carried carried) {
    double sum = 0;
    for (int i = 0; i < kOffsets; ++i) {
      const double gamma = std::asin(2 * (i + 0.5) / kOffsets - 1);
      sum += SharedOut(hair, Direction(theta_first, gamma), Direction(theta_second, gamma + phi),
                       carried);
    }
    return sum / kOffsets;
  };
  for (const double from : {-0.9, 0.1, 0.6}) {
    for (const double to : {-0.7, -0.1, 0.8}) {
      for (const double phi : {0.5, 1.7, 2.9, -2.1}) {
        const double photons = mean(from, to, phi, Carried::kFlux);
        const double seen = mean(to, from, -phi, Carried::kRadiance);
        const double expected = seen * std::cos(to) / std::cos(from);
        // Sums over the width differ by their ends, where gamma changes fast.
        EXPECT_NEAR(photons, expected, 2e-3 * expected) << from << " " << to << " " << phi;
      }
    }
  }
}

TEST(HairTest, TheReflectanceOfAnAbsorptionIsTheOneItIsFor) {
  for (const float beta_n : {0.1F, 0.3F, 0.9F}) {
    const Rgb reflectance = {0.05F, 0.4F, 0.95F};
    const Rgb back = HairReflectance(HairAbsorption(reflectance, beta_n), beta_n);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(back[c], reflectance[c], 1e-5F);
  }
  EXPECT_EQ(HairAbsorption(Gray(1), 0.3F), Rgb());
  EXPECT_TRUE(IsFinite(HairAbsorption(Gray(0), 0.3F)));
}

// An arc of a tube.
Scene BentTube(const Material& material, float radius) {
  Scene scene;
  const std::int32_t number = AddMaterial(scene, material);
  constexpr int kPieces = 12;
  const auto point = [](int i) {
    const double angle = 0.15 * i;
    return Vec3{static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0};
  };
  for (int i = 0; i < kPieces; ++i) {
    CurvePiece piece;
    piece.from = point(i);
    piece.to = point(i + 1);
    piece.from_radius = piece.to_radius = radius;
    piece.from_u = static_cast<float>(i) / kPieces;
    piece.to_u = static_cast<float>(i + 1) / kPieces;
    piece.center = piece.from * 0.5F + piece.to * 0.5F;
    piece.traits.material = number;
    scene.curve_pieces.push_back(piece);
  }
  return scene;
}

// Rays that are refracted along the fibre meet the ends of other pieces within it: those are no
// surfaces. Rays from outside meet the tube everywhere.
TEST(HairTest, RaysLeaveABentTubeUnseen) {
  constexpr float kRadius = 0.1F;
  const Scene scene = BentTube(HairMaterial(0, 0.3F, 0.3F), kRadius);
  const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
  KeyedRng rng(3);
  int along = 0;
  for (int i = 0; i < 20000; ++i) {
    const double angle = 0.15 + 1.5 * static_cast<double>(rng.Uniform());
    const Vec3 middle = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)),
                         0};
    const float u1 = rng.Uniform();
    const float u2 = rng.Uniform();
    const Vec3 direction = SquareToSphere(u1, u2);
    Hit hit;
    // From far outside to the middle of the tube.
    const Ray towards = {middle - direction * 3, direction, 3};
    ASSERT_TRUE(intersector->Intersect(towards, hit)) << i;
    ASSERT_TRUE(intersector->Occluded(towards));
    const SurfacePoint surface = intersector->SurfaceAt(towards, hit);
    ASSERT_GT(Dot(surface.geometric_normal, -direction), 0);
    // Within: no farther than where the tube's turn lets the ray out and in again.
    const Vec3 tangent = {-middle.y, middle.x, 0};
    const float axial = std::abs(Dot(direction, tangent));
    if (axial > 0.9F) continue;
    const Ray within = {middle, direction, 2 * kRadius / std::sqrt(1 - axial * axial)};
    if (axial > 0.7F) ++along;
    ASSERT_FALSE(intersector->Intersect(within, hit)) << i << " " << axial;
    ASSERT_FALSE(intersector->Occluded(within));
  }
  EXPECT_GT(along, 1000);
}

// The frame in which hair scatters lies along the fibre.
TEST(HairTest, IsTurnedAlongTheFibre) {
  const Scene scene = InWorkingSpace(BentTube(HairMaterial(0.5F, 0.3F, 0.3F), 0.02F));
  const std::unique_ptr<Intersector> intersector = Intersector::Create(scene).value();
  const Vec3 middle = {std::cos(0.975F), std::sin(0.975F), 0};
  const Ray ray = {middle + Vec3{0, 0.005F, 1}, {0, 0, -1}, HUGE_VALF};
  Hit hit;
  ASSERT_TRUE(intersector->Intersect(ray, hit));
  SurfacePoint surface = intersector->SurfaceAt(ray, hit);
  std::optional<Material> storage;
  const Material& here = MaterialAt(scene, surface, -ray.direction, storage);
  EXPECT_EQ(here.kind, Material::Kind::kHair);
  EXPECT_EQ(here.absorption, scene.materials[0].absorption);
  const Vec3 tangent = Normalize({-middle.y, middle.x, 0});
  EXPECT_NEAR(Dot(ShadingFrame(surface).s, tangent), 1, 1e-4F);
}

}  // namespace
}  // namespace lucerna
