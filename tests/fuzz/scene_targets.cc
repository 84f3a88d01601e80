// Any bytes as the files of a scene: no crash, no hang, no memory without bound, and what is
// accepted is sound.
#include <array>
#include <cstdint>
#include <utility>

#include "render/formats/image_file.h"
#include "render/formats/measured_file.h"
#include "render/formats/mitsuba/meshes.h"
#include "render/formats/ply_file.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/scene_from_bytes.h"
#include "tests/fuzz/sound_scene.h"

namespace lucerna {
namespace {

std::vector<std::string> SeedsOf(const std::string& folder) {
  std::vector<std::string> seeds;
  for (NamedBytes& seed : FilesOf(folder))
    seeds.push_back(std::move(seed.bytes));
  return seeds;
}

// Returns whether it was accepted.
bool IsSoundOrRefused(const ParsedScene& parsed) {
  LUCERNA_CHECK(!parsed.ok() || WhatIsUnsound(parsed.scene).empty());
  LUCERNA_CHECK(parsed.ok() || !parsed.ToStatus().ok());
  return parsed.ok();
}

}  // namespace

bool FuzzPbrt(std::string_view bytes) {
  return IsSoundOrRefused(SceneFromBytes(bytes));
}

std::vector<std::string> PbrtSeeds() {
  return SeedsOf("fuzz/seeds/pbrt");
}

// As text and as one file with its buffer: the first bytes decide.
bool FuzzGltf(std::string_view bytes) {
  return IsSoundOrRefused(SceneFromBytes(bytes, "fuzz.gltf"));
}

std::vector<std::string> GltfSeeds() {
  return SeedsOf("fuzz/seeds/gltf");
}

bool FuzzMitsuba(std::string_view bytes) {
  return IsSoundOrRefused(SceneFromBytes(bytes, "fuzz.xml"));
}

std::vector<std::string> MitsubaSeeds() {
  return SeedsOf("fuzz/seeds/mitsuba");
}

// Mitsuba's files of meshes, of both formats.
bool FuzzObj(std::string_view bytes) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 24;
  bool is_accepted = false;
  for (const bool is_obj : {true, false}) {
    const auto mesh = is_obj ? ParseObj(bytes) : ParseSerialized(bytes, 0, kMostBytes);
    if (!mesh.ok()) continue;
    for (const std::uint32_t index : mesh->indices)
      LUCERNA_CHECK(index < mesh->positions.size());
    for (const Vec3 position : mesh->positions)
      LUCERNA_CHECK(IsFinite(position));
    is_accepted = true;
  }
  return is_accepted;
}

std::vector<std::string> ObjSeeds() {
  return SeedsOf("fuzz/seeds/obj");
}

bool FuzzPly(std::string_view bytes) {
  const auto mesh = ParsePly(bytes);
  if (!mesh.ok()) return false;
  for (const std::uint32_t index : mesh->indices)
    LUCERNA_CHECK(index < mesh->positions.size());
  for (const Vec3 position : mesh->positions)
    LUCERNA_CHECK(IsFinite(position));
  return true;
}

std::vector<std::string> PlySeeds() {
  return SeedsOf("fuzz/seeds/ply");
}

bool FuzzView(std::string_view bytes) {
  return IsSoundOrRefused(SceneFromBytes(bytes, "fuzz.view.json"));
}

std::vector<std::string> ViewSeeds() {
  return SeedsOf("fuzz/seeds/view");
}

bool FuzzSensors(std::string_view bytes) {
  return IsSoundOrRefused(SceneFromBytes(bytes, "fuzz.ply"));
}

std::vector<std::string> SensorsSeeds() {
  return SeedsOf("fuzz/seeds/sensors");
}

// What is accepted scatters finite light by a density that is none below zero.
bool FuzzMeasured(std::string_view bytes) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  if (bytes.size() > kMostBytes) return false;
  const auto table = ParseMeasured(bytes);
  if (!table.ok()) return false;
  LUCERNA_CHECK(IsFinite(table->Albedo(table->WorkingSpace())));
  const Vec3 wo = Normalize({0.3F, -0.2F, 0.4F});
  for (const float u : {0.0F, 0.4F, 0.999999F}) {
    const MeasuredTable::Drawn drawn = table->Sample(wo, u, 1 - 0.99F * u - 0.005F);
    LUCERNA_CHECK(IsFinite(drawn.wi) && drawn.pdf >= 0);
    if (drawn.wi.z > 0)
      LUCERNA_CHECK(IsFinite(table->Scattered(wo, drawn.wi, table->At({650, 550, 450}))));
  }
  return true;
}

std::vector<std::string> MeasuredSeeds() {
  return SeedsOf("fuzz/seeds/measured");
}

// As a file of each format.
bool FuzzImage(std::string_view bytes) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;
  bool is_accepted = false;
  for (const char* name : {"a.png", "a.jpg", "a.tga", "a.hdr", "a.pfm", "a.exr"}) {
    const auto picture = ReadPicture(bytes, name, {}, kMostBytes);
    if (!picture.ok()) continue;
    LUCERNA_CHECK(PictureIsSound(*picture) && SizeBytes(*picture) <= kMostBytes);
    is_accepted = true;
  }
  return is_accepted;
}

std::vector<std::string> ImageSeeds() {
  return SeedsOf("fuzz/seeds/image");
}

}  // namespace lucerna
