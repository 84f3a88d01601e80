#include "tests/support/path_classes.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include "render/math/rng.h"
#include "render/transport/coat_tables.h"
#include "tests/support/test_scenes.h"

namespace lucerna {
namespace {

bool GathersCaustics(Floor floor) {
  return floor == Floor::kNarrowMetal || floor == Floor::kTexturedMetal ||
         floor == Floor::kNarrowGlass || floor == Floor::kRoughCoated || floor == Floor::kMixed ||
         floor == Floor::kPatchyMetal || floor == Floor::kPatchyCoat ||
         floor == Floor::kRoughSubsurface || floor == Floor::kPatchySubsurface ||
         floor == Floor::kPatchySheer;
}
bool IsWall(Chain chain) {
  return chain == Chain::kMirror || chain == Chain::kNarrowWall || chain == Chain::kDiffuseWall ||
         chain == Chain::kPaneAndNarrowWall || chain == Chain::kCoatedWall ||
         chain == Chain::kSubsurfaceWall;
}

// Of lights that come straight to the floor.
constexpr Vec3 kPlace = {0.05F, 1.2F, 1.6F};

// Below surfaces: much less than from what the camera sees to an edge.
constexpr float kFreePath = 0.01F;

Material Metal(float alpha) {
  return ConductorMaterial(Gray(0.2F), Gray(3), alpha, alpha);
}

// Squares of two roughnesses, of which the first is smooth, as the scene's textures.
void AddPatches(Scene& scene, float roughness) {
  Texture smooth;
  smooth.color = Gray(0);
  Texture rough;
  rough.color = Gray(roughness);
  Texture board;
  board.kind = Texture::Kind::kCheckerboard;
  board.parts = {0, 1, -1, -1};
  board.mapping = ByUv(5, 5, 0, 0);
  scene.textures = {smooth, rough, board};
}

Material Patchy(Material material) {
  material.roughness_textures[0] = material.roughness_textures[1] = 2;
  material.may_be_smooth = true;
  return material;
}

// Heights as a picture of 16 by 16 pixels, drawn.
void AddHeights(Scene& scene) {
  Picture picture;
  picture.width = picture.height = 16;
  picture.channels = 1;
  KeyedRng rng(3);
  for (int i = 0; i < picture.width * picture.height; ++i)
    picture.linear.push_back(rng.Uniform());
  Texture heights;
  heights.kind = Texture::Kind::kPicture;
  heights.is_number = true;
  heights.scale = 0.05F;
  heights.picture = std::make_shared<const Picture>(picture);
  scene.textures = {heights};
}

// Straight hairs side by side over the whole floor, at a height above it.
void AddHairs(Scene& scene, float height, float radius, float distance, float inclination) {
  const std::int32_t hair = AddMaterial(scene, HairMaterial(0.15F, 0.5F, 0.5F));
  const auto count = static_cast<int>(2.4F / distance);
  for (int i = 0; i < count; ++i) {
    const float x = (static_cast<float>(i) + 0.5F) * distance - 1.2F;
    CurvePiece piece;
    piece.from = {x, -1, height - inclination};
    piece.to = {x, 1, height + inclination};
    piece.center = {x, 0, height};
    piece.from_radius = piece.to_radius = radius;
    piece.traits.material = hair;
    scene.curve_pieces.push_back(piece);
  }
}

}  // namespace

std::vector<PathClass> AllPathClasses() {
  using enum LightKind;
  using enum Chain;
  const std::vector<Floor> narrow = {Floor::kNarrowMetal, Floor::kTexturedMetal,
                                     Floor::kNarrowGlass};
  const std::vector<Floor> two = {Floor::kDiffuse, Floor::kNarrowMetal};
  std::vector<PathClass> cells;
  const auto add = [&](const std::vector<LightKind>& lights, const std::vector<Chain>& chains,
                       const std::vector<Floor>& floors, View view = View::kPlain) {
    for (const LightKind light : lights) {
      for (const Chain chain : chains) {
        for (const Floor floor : floors)
          cells.push_back({light, chain, floor, view});
      }
    }
  };
  add({kTriangles, kPoint}, {kNone, kPane, kRoughPane, kMirror, kNarrowWall, kDiffuseWall},
      {Floor::kDiffuse, Floor::kRoughMetal, Floor::kNarrowMetal, Floor::kTexturedMetal,
       Floor::kNarrowGlass, Floor::kRoughGlass});
  // What differs from those in the light alone.
  add({kDistant}, {kNone, kPane, kRoughPane, kMirror, kNarrowWall, kDiffuseWall},
      {Floor::kDiffuse, Floor::kNarrowMetal, Floor::kTexturedMetal, Floor::kNarrowGlass});
  add({kMap}, {kNone, kPane, kRoughPane, kMirror, kNarrowWall, kDiffuseWall},
      {Floor::kDiffuse, Floor::kRoughMetal, Floor::kNarrowMetal});
  add({kSphere, kDisk, kConstant}, {kNone, kPane}, two);
  add({kPicture, kPortal}, {kNone, kPane, kMirror, kDiffuseWall}, two);
  add({kPicture, kPortal}, {kPane}, {Floor::kDiffuse}, View::kThroughGlass);
  add({kSpot}, {kNone, kPane, kMirror}, two);
  add({kSpot}, {kPane}, {Floor::kTexturedMetal, Floor::kNarrowGlass});
  // As bright as without the pane.
  add({kPoint, kSpot, kDistant}, {kThinPane}, narrow);
  add({kTriangles, kPoint, kDistant}, {kPaneAndNarrowWall}, two);
  add({kSphere, kPoint}, {kInBall, kInNarrowBall, kInRoughBall}, two);
  add({kTriangles, kPoint}, {kNone, kPane},
      {Floor::kDiffuse, Floor::kNarrowMetal, Floor::kNarrowGlass}, View::kThroughGlass);
  add({kTriangles, kPoint}, {kNone, kPane}, two, View::kInMirror);
  // Surfaces in two parts.
  add({kTriangles, kPoint}, {kNone, kPane, kDiffuseWall},
      {Floor::kCoated, Floor::kRoughCoated, Floor::kSheet});
  add({kMap}, {kNone, kPane}, {Floor::kCoated, Floor::kRoughCoated, Floor::kSheet});
  add({kTriangles, kPoint}, {kCoatedWall}, {Floor::kDiffuse, Floor::kNarrowMetal, Floor::kCoated});
  add({kTriangles}, {kNone, kPane}, {Floor::kHazyCoat, Floor::kPatchyHaze});
  add({kTriangles, kPoint}, {kPane}, {Floor::kSheer, Floor::kPatchySheer});
  // Light that comes out elsewhere than where it entered.
  add({kTriangles, kPoint}, {kNone, kPane}, {Floor::kSubsurface});
  add({kTriangles}, {kNone}, {Floor::kRoughSubsurface});
  add({kTriangles, kPoint}, {kPane}, {Floor::kRoughSubsurface, Floor::kPatchySubsurface});
  add({kMap}, {kNone}, {Floor::kSubsurface});
  add({kTriangles}, {kDiffuseWall}, {Floor::kSubsurface});
  add({kTriangles}, {kSubsurfaceWall}, {Floor::kDiffuse, Floor::kSubsurface});
  add({kPoint}, {kSubsurfaceWall}, {Floor::kNarrowMetal});
  // Surfaces that are another one at each place.
  add({kTriangles, kPoint}, {kNone, kPane},
      {Floor::kMixed, Floor::kPatchyMetal, Floor::kPatchyCoat, Floor::kBumpy});
  add({kMap}, {kPane}, {Floor::kMixed, Floor::kPatchyMetal, Floor::kBumpy});
  // Thin, and to be scattered by.
  add({kTriangles, kPoint, kMap}, {kNone, kDiffuseWall}, {Floor::kHairs});
  add({kTriangles, kMap}, {kPane}, {Floor::kHairs});
  add({kTriangles, kPoint, kDistant, kMap}, {kHairs}, two);
  add({kTriangles}, {kHairs}, {Floor::kHairs});
  add({kTriangles}, {kNone}, {Floor::kCoated, Floor::kRoughCoated}, View::kThroughGlass);
  add({kTriangles}, {kPane}, {Floor::kCoated, Floor::kRoughCoated}, View::kInMirror);
  return cells;
}

std::string NameOf(const PathClass& cell) {
  constexpr std::array<std::string_view, 10> kLights = {"Triangles", "Sphere",  "Disk",     "Point",
                                                        "Spot",      "Distant", "Constant", "Map",
                                                        "Picture",   "Portal"};
  constexpr std::array<std::string_view, 14> kChains = {"Directly",
                                                        "ByPane",
                                                        "ByThinPane",
                                                        "ByRoughPane",
                                                        "ByMirror",
                                                        "ByNarrowMetal",
                                                        "ByCoat",
                                                        "BySubsurfaceWall",
                                                        "ByDiffuseWall",
                                                        "ByHair",
                                                        "ByPaneAndNarrowMetal",
                                                        "InGlassBall",
                                                        "InNarrowGlassBall",
                                                        "InRoughGlassBall"};
  constexpr std::array<std::string_view, 21> kFloors = {
      "Diffuse",         "RoughMetal",       "NarrowMetal", "TexturedMetal", "NarrowGlass",
      "RoughGlass",      "Coated",           "RoughCoated", "Sheet",         "Mixed",
      "PatchyMetal",     "PatchyCoat",       "Bumpy",       "Hair",          "Subsurface",
      "RoughSubsurface", "PatchySubsurface", "HazyCoat",    "PatchyHaze",    "Sheer",
      "PatchySheer"};
  constexpr std::array<std::string_view, 3> kViews = {"", "SeenThroughGlass", "SeenInMirror"};
  std::string name(kLights[static_cast<std::size_t>(cell.light)]);
  name += kChains[static_cast<std::size_t>(cell.chain)];
  name += "On";
  name += kFloors[static_cast<std::size_t>(cell.floor)];
  name += kViews[static_cast<std::size_t>(cell.view)];
  return name;
}

std::uint64_t KeyOf(std::string_view name) {
  std::uint64_t key = 0;
  for (const char c : name)
    key = CombineKeys(key, static_cast<unsigned char>(c));
  return key;
}

Scene SceneOf(const PathClass& cell) {
  Scene scene;
  const std::int32_t black = AddMaterial(scene, DiffuseMaterial(0));

  const auto floor = [&](std::int32_t material) {
    AddQuad(scene, {-0.7F, -0.8F, 0}, {1.4F, 0, 0}, {0, 1.6F, 0}, material);
  };
  const auto floor_with_uv = [&](std::int32_t material) {
    floor(material);
    scene.meshes.back().uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  };
  switch (cell.floor) {
    case Floor::kDiffuse:
      floor(AddMaterial(scene, DiffuseMaterial(0.6F)));
      break;
    case Floor::kRoughMetal:
      floor(AddMaterial(scene, Metal(0.3F)));
      break;
    case Floor::kNarrowMetal:
      floor(AddMaterial(scene, Metal(0.1F)));
      break;
    case Floor::kTexturedMetal: {
      Texture dark;
      dark.color = Gray(0.3F);
      Texture bright;
      bright.color = Gray(0.9F);
      Texture board;
      board.kind = Texture::Kind::kCheckerboard;
      board.parts = {0, 1, -1, -1};
      board.mapping = ByUv(6, 6, 0, 0);
      scene.textures = {dark, bright, board};
      Material metal = Metal(0.3F);
      metal.texture = 2;
      floor(AddMaterial(scene, metal));
      break;
    }
    case Floor::kNarrowGlass:
    case Floor::kRoughGlass:
      // With a diffuse bottom inside the glass.
      floor(AddMaterial(scene,
                        DielectricMaterial(1.5F, cell.floor == Floor::kNarrowGlass ? 0.2F : 0.6F)));
      AddQuad(scene, {-0.9F, -1, -0.1F}, {1.8F, 0, 0}, {0, 2, 0},
              AddMaterial(scene, DiffuseMaterial(0.6F)));
      break;
    case Floor::kCoated:
      floor(AddMaterial(scene, CoatedMaterial(0.9F, 0, 0.5F)));
      break;
    case Floor::kRoughCoated:
      floor(AddMaterial(scene, CoatedMaterial(0.8F, 0.2F, 0.5F)));
      break;
    case Floor::kSubsurface:
      floor(AddMaterial(scene, SubsurfaceMaterial(0.8F, kFreePath)));
      break;
    case Floor::kHazyCoat:
      floor(AddMaterial(scene, WithHaze(CoatedMaterial(0.5F, 0, 0.7F), 0.9F, 0)));
      break;
    case Floor::kPatchyHaze: {
      AddPatches(scene, 0.7F);
      std::vector<Material> one = {WithHaze(CoatedMaterial(0.5F, 0, 0.7F), 0.9F, 0)};
      one[0].thickness_texture = 2;
      PrepareCoats(one);
      floor_with_uv(AddMaterial(scene, one[0]));
      break;
    }
    case Floor::kSheer:
      floor(AddMaterial(scene, DiffuseMaterial(0.6F)));
      scene.meshes.back().traits.alpha = 0.4F;
      break;
    case Floor::kPatchySheer:
      AddPatches(scene, 0.7F);
      floor_with_uv(AddMaterial(scene, Metal(0.1F)));
      scene.meshes.back().traits.alpha = 0.7F;
      scene.meshes.back().traits.alpha_texture = 2;
      break;
    case Floor::kRoughSubsurface:
      floor(AddMaterial(scene, SubsurfaceMaterial(0.7F, kFreePath, 0.2F)));
      break;
    case Floor::kSheet:
      // What it transmits comes back from below.
      floor(AddMaterial(scene, SheetMaterial(0.2F, 0.6F)));
      AddQuad(scene, {-0.9F, -1, -0.3F}, {1.8F, 0, 0}, {0, 2, 0},
              AddMaterial(scene, DiffuseMaterial(0.8F)));
      break;
    default:
      break;
  }

  switch (cell.floor) {
    case Floor::kMixed: {
      // Diffuse under lacquer, and narrow metal.
      const std::int32_t coat = AddMaterial(scene, CoatedMaterial(0.7F, 0, 0.2F));
      const std::int32_t metal = AddMaterial(scene, Metal(0.1F));
      Material mix;
      mix.kind = Material::Kind::kMix;
      mix.mixed = {coat, metal};
      mix.mix_depth = 1;
      mix.amount = 0.4F;
      floor(AddMaterial(scene, mix));
      JoinMixes(scene.materials);
      break;
    }
    case Floor::kPatchyMetal:
      AddPatches(scene, 0.02F);
      floor_with_uv(AddMaterial(scene, Patchy(Metal(std::sqrt(0.02F)))));
      break;
    case Floor::kPatchyCoat:
      AddPatches(scene, 0.04F);
      floor_with_uv(AddMaterial(scene, Patchy(CoatedMaterial(0.8F, 0.2F, 0.5F))));
      break;
    case Floor::kPatchySubsurface:
      AddPatches(scene, 0.04F);
      floor_with_uv(AddMaterial(scene, Patchy(SubsurfaceMaterial(0.7F, kFreePath, 0.2F))));
      break;
    case Floor::kBumpy: {
      AddHeights(scene);
      Material material = DiffuseMaterial(0.6F);
      material.displacement = 0;
      material.slope_step = SlopeStep(scene.textures, 0);
      floor_with_uv(AddMaterial(scene, material));
      break;
    }
    case Floor::kHairs:
      // Two layers, and what comes through them.
      AddHairs(scene, 0.05F, 0.004F, 0.013F, 0);
      AddHairs(scene, 0.1F, 0.004F, 0.017F, 0.03F);
      floor(AddMaterial(scene, DiffuseMaterial(0.6F)));
      break;
    default:
      break;
  }

  const auto pane = [&](const Material& material) {
    AddBox(scene, {-1, -1, 0.9F}, {1, 1, 1}, AddMaterial(scene, material));
  };
  const auto wall = [&](const Material& material) {
    AddQuad(scene, {-1, 0.85F, 0.02F}, {2, 0, 0}, {0, 0, 1.4F}, AddMaterial(scene, material));
    // The sun's shadow of its edge would be blurred where a cone stands for the sun.
    if (cell.light != LightKind::kDistant) {
      AddQuad(scene, {-0.8F, -1.7F, 1.1F}, {1.6F, 0, 0}, {0, 1.35F, 0}, black);
    }
  };
  switch (cell.chain) {
    case Chain::kNone:
      break;
    case Chain::kPane:
      pane(DielectricMaterial(1.5F));
      break;
    case Chain::kThinPane:
      pane(DielectricMaterial(1.0001F));
      break;
    case Chain::kRoughPane:
      pane(DielectricMaterial(1.5F, 0.2F));
      break;
    case Chain::kMirror:
      wall(Metal(0));
      break;
    case Chain::kNarrowWall:
      wall(Metal(0.1F));
      break;
    case Chain::kCoatedWall:
      wall(CoatedMaterial(0.3F, 0));
      break;
    case Chain::kSubsurfaceWall:
      wall(SubsurfaceMaterial(0.8F, kFreePath));
      break;
    case Chain::kDiffuseWall:
      wall(DiffuseMaterial(0.8F));
      break;
    case Chain::kHairs:
      // Closed enough that most light is scattered by them; the camera is below.
      AddHairs(scene, 1, 0.004F, 0.01F, 0.1F);
      break;
    case Chain::kPaneAndNarrowWall:
      wall(Metal(0.1F));
      AddBox(scene, {-0.9F, -1.2F, 1.5F}, {0.9F, 0.5F, 1.6F},
             AddMaterial(scene, DielectricMaterial(1.5F)));
      break;
    case Chain::kInBall:
    case Chain::kInNarrowBall:
    case Chain::kInRoughBall:
      AddSphere(scene, kPlace, 0.35F,
                AddMaterial(scene,
                            DielectricMaterial(1.5F, cell.chain == Chain::kInBall         ? 0
                                                     : cell.chain == Chain::kInNarrowBall ? 0.2F
                                                                                          : 0.6F)));
      break;
  }

  const bool by_wall = IsWall(cell.chain);
  const Vec3 place = by_wall ? Vec3{0.05F, -1, 2.2F} : kPlace;
  const Vec3 lit = by_wall ? Vec3{0, 0.85F, 0.8F} : Vec3{0, 0, 0};
  const Vec3 along = Normalize(lit - place);
  const auto area_light = [&] { return AddAreaLight(scene, 15, cell.light == LightKind::kDisk); };
  const auto picture = [] {
    Picture made;
    made.width = made.height = 6;
    made.channels = 1;
    for (int i = 0; i < 36; ++i)
      made.linear.push_back(0.1F + 0.4F * static_cast<float>(i * 7 % 5));
    return std::make_shared<const Picture>(std::move(made));
  };
  switch (cell.light) {
    case LightKind::kTriangles: {
      const Frame frame(along);
      AddQuad(scene, place - (frame.s + frame.t) * 0.2F, frame.s * 0.4F, frame.t * 0.4F, black,
              area_light());
      break;
    }
    case LightKind::kSphere:
      AddSphere(scene, place, 0.2F, black, area_light());
      break;
    case LightKind::kDisk:
      AddDisk(scene, place, along, 0.22F, black, area_light());
      break;
    case LightKind::kPoint:
      scene.point_lights.push_back({place, Gray(3)});
      break;
    case LightKind::kSpot:
      scene.spot_lights.push_back({place, along, Gray(3), std::cos(0.25F), std::cos(0.7F)});
      break;
    case LightKind::kDistant:
      scene.distant_lights.push_back({along, Gray(1)});
      break;
    case LightKind::kConstant:
      scene.infinite_lights.push_back({Gray(0.7F)});
      break;
    case LightKind::kMap: {
      InfiniteLight light;
      light.radiance = Gray(1);
      light.kind = InfiniteLight::Kind::kEnvironment;
      light.map = picture();
      scene.infinite_lights.push_back(light);
      break;
    }
    case LightKind::kPicture: {
      AreaLight light = {Gray(18), false, picture()};
      light.largest_pixel = light.picture->Largest();
      scene.area_lights.push_back(light);
      const Frame frame(along);
      AddQuad(scene, place - (frame.s + frame.t) * 0.2F, frame.s * 0.4F, frame.t * 0.4F, black, 0);
      scene.meshes.back().uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      break;
    }
    case LightKind::kPortal: {
      InfiniteLight light;
      light.radiance = Gray(15);
      light.kind = InfiniteLight::Kind::kPortal;
      light.map = picture();
      const Frame frame(along);
      light.portal = Portal{place - (frame.s + frame.t) * 0.2F, frame.t * 0.4F, frame.s * 0.4F};
      scene.infinite_lights.push_back(light);
      break;
    }
  }

  constexpr double kFovDeg = 28;
  constexpr int kSize = 8;
  switch (cell.view) {
    case View::kPlain:
      SetCamera(scene, {0, -0.8, 0.8}, {0, 0, 0}, {0, 0, 1}, kFovDeg, kSize);
      break;
    case View::kThroughGlass:
      // Through the pane that the light passes, or one of the camera's own.
      SetCamera(scene, {0, -0.75, 1.25}, {0, 0, 0}, {0, 0, 1}, 21, kSize);
      if (cell.chain == Chain::kNone) {
        AddBox(scene, {-0.3F, -0.9F, 0.9F}, {0.3F, -0.35F, 0.96F},
               AddMaterial(scene, DielectricMaterial(1.5F)));
      }
      break;
    case View::kInMirror:
      SetCamera(scene, {0, -0.1, 0.85}, {0, -1.8, 0}, {0, 0, 1}, 14, kSize);
      AddQuad(scene, {-0.7F, -0.9F, 0.1F}, {1.4F, 0, 0}, {0, 0, 0.75F},
              AddMaterial(scene, Metal(0)));
      break;
  }
  return scene;
}

// Narrow lobes want small emitters in place of delta lights; below broad ones, large ones are found
// more often.
Effort EffortFor(const PathClass& cell) {
  Effort effort;
  switch (cell.floor) {
    case Floor::kRoughMetal:
    case Floor::kTexturedMetal:
      effort.delta_radius = 0.12F;
      break;
    case Floor::kNarrowMetal:
    case Floor::kPatchyMetal:
    case Floor::kPatchySheer:
    case Floor::kMixed:
      effort.delta_radius = 0.08F;
      break;
    default:
      effort.delta_radius = 0.2F;
      break;
  }
  if (cell.light == LightKind::kSpot) effort.delta_radius = 0.08F;
  // Found by few of the photons or scattered rays.
  if (cell.floor == Floor::kRoughGlass || cell.floor == Floor::kRoughMetal) effort.photons = 6000;
  if (GathersCaustics(cell.floor) && cell.chain != Chain::kNone) effort.passes = 22;
  if (effort.delta_radius < 0.1F) effort.paths = 28000;
  if (cell.chain == Chain::kInBall || cell.chain == Chain::kInNarrowBall ||
      cell.chain == Chain::kInRoughBall) {
    effort.delta_radius = 0.06F;
  }
  // Most of the light is that of very few paths: with 16,000 of them the path tracer's mean is
  // mostly half of what it is with 640,000, and its standard error as far off.
  if (cell.floor == Floor::kHairs && cell.light == LightKind::kPoint &&
      cell.chain == Chain::kDiffuseWall) {
    effort.paths = 160000;
  }
  return effort;
}

}  // namespace lucerna
