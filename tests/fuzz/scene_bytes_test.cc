// Whatever the bytes of a scene, a mesh or an image are, reading them ends, in bounded memory, with
// a sound value or with errors that name a place. The bad files of corpus/ stay refused.
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

#include "render/formats/image_file.h"
#include "render/formats/ply_file.h"
#include "tests/fuzz/mutation.h"
#include "tests/fuzz/scene_from_bytes.h"
#include "tests/fuzz/sound_scene.h"

namespace lucerna {
namespace {

StatusOr<Picture> ReadNamed(const std::string& bytes, const std::string& name) {
  return ReadPicture(bytes, name, {}, std::uint64_t{1} << 24);
}

// Every directive and most parameters in one small scene.
std::string WholeScene() {
  return FilesOf("fuzz/seeds/pbrt").at(0).bytes;
}

void ExpectSoundOrRefused(const ParsedScene& parsed) {
  if (parsed.ok()) {
    EXPECT_EQ(WhatIsUnsound(parsed.scene), "");
  } else {
    EXPECT_FALSE(parsed.ToStatus().ok());
  }
  EXPECT_LE(parsed.diagnostics.size(), 300U);
}

TEST(SceneBytesTest, TheSeedsAreGood) {
  const ParsedScene parsed = SceneFromBytes(WholeScene());
  EXPECT_TRUE(parsed.ok()) << parsed.ToStatus();
  EXPECT_EQ(WhatIsUnsound(parsed.scene), "");
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/ply")) {
    EXPECT_TRUE(ParsePly(seed.bytes).ok()) << seed.name;
  }
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/image")) {
    const StatusOr<Picture> picture = ReadNamed(seed.bytes, seed.name);
    EXPECT_TRUE(picture.ok()) << seed.name << " " << picture.status();
  }
}

TEST(SceneBytesTest, TheCorpusOfBadScenesIsRefused) {
  const std::vector<NamedBytes> corpus = FilesOf("fuzz/corpus/pbrt");
  EXPECT_GE(corpus.size(), 10U);
  for (const NamedBytes& bad : corpus) {
    const ParsedScene parsed = SceneFromBytes(bad.bytes);
    EXPECT_FALSE(parsed.ok()) << bad.name;
    EXPECT_LE(parsed.diagnostics.size(), 300U) << bad.name;
  }
}

TEST(SceneBytesTest, TheCorpusOfBadMeshesIsRefused) {
  const std::vector<NamedBytes> corpus = FilesOf("fuzz/corpus/ply");
  EXPECT_GE(corpus.size(), 10U);
  for (const NamedBytes& bad : corpus)
    EXPECT_FALSE(ParsePly(bad.bytes).ok()) << bad.name;
}

TEST(SceneBytesTest, TheCorpusOfBadImagesIsRefused) {
  const std::vector<NamedBytes> corpus = FilesOf("fuzz/corpus/image");
  EXPECT_GE(corpus.size(), 10U);
  for (const NamedBytes& bad : corpus)
    EXPECT_FALSE(ReadNamed(bad.bytes, bad.name).ok()) << bad.name;
}

TEST(SceneBytesTest, AnImageCutOffAnywhereIsRefused) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/image")) {
    // The checksum of a PNG's last chunk is not asked for.
    const std::size_t enough = seed.bytes.size() - (seed.name.ends_with(".png") ? 4 : 0);
    for (std::size_t size = 0; size < enough; ++size) {
      EXPECT_FALSE(ReadNamed(seed.bytes.substr(0, size), seed.name).ok()) << seed.name << size;
    }
  }
}

TEST(SceneBytesTest, MutatedImagesAreSoundOrRefused) {
  int accepted = 0;
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/image")) {
    for (std::uint64_t key = 0; key < 10'000; ++key) {
      const std::string bytes = Mutated(seed.bytes, key);
      const StatusOr<Picture> picture = ReadNamed(bytes, seed.name);
      if (!picture.ok()) continue;
      ++accepted;
      ASSERT_TRUE(PictureIsSound(*picture)) << seed.name << " " << key;
      // The same bytes give the same pixels: none come from elsewhere in memory.
      const StatusOr<Picture> again = ReadNamed(bytes, seed.name);
      ASSERT_TRUE(again.ok() && again->coded == picture->coded && again->linear == picture->linear)
          << seed.name << " " << key;
    }
  }
  EXPECT_GT(accepted, 1000);
}

TEST(SceneBytesTest, ASceneCutOffAnywhereIsSoundOrRefused) {
  const std::string whole = WholeScene();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    SCOPED_TRACE(size);
    ExpectSoundOrRefused(SceneFromBytes(whole.substr(0, size)));
  }
}

TEST(SceneBytesTest, AMeshCutOffAnywhereIsRefused) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/ply")) {
    // The last line's end is not needed, nor are the last digits of an ASCII index.
    const bool is_text = seed.name == "ascii.ply";
    for (std::size_t size = 0; size + (is_text ? 2 : 0) < seed.bytes.size(); ++size) {
      EXPECT_FALSE(ParsePly(seed.bytes.substr(0, size)).ok()) << seed.name << " " << size;
    }
  }
}

TEST(SceneBytesTest, MutatedScenesAreSoundOrRefused) {
  const std::string whole = WholeScene();
  int accepted = 0;
  for (std::uint64_t key = 0; key < 20'000; ++key) {
    SCOPED_TRACE(key);
    const ParsedScene parsed = SceneFromBytes(Mutated(whole, key));
    ExpectSoundOrRefused(parsed);
    accepted += parsed.ok() ? 1 : 0;
  }
  // Were none accepted, the mutations would be too coarse to reach beyond the first checks.
  EXPECT_GT(accepted, 100);
}

TEST(SceneBytesTest, TheGltfSeedsAreGood) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/gltf")) {
    const ParsedScene parsed = SceneFromBytes(seed.bytes, seed.name);
    EXPECT_TRUE(parsed.ok()) << seed.name << " " << parsed.ToStatus();
    EXPECT_EQ(WhatIsUnsound(parsed.scene), "") << seed.name;
    EXPECT_EQ(parsed.scene.meshes.size(), seed.name == "skinned.gltf" ? 2U : 7U) << seed.name;
  }
}

TEST(SceneBytesTest, TheCorpusOfBadGltfIsRefused) {
  const std::vector<NamedBytes> corpus = FilesOf("fuzz/corpus/gltf");
  EXPECT_GE(corpus.size(), 10U);
  for (const NamedBytes& bad : corpus) {
    const ParsedScene parsed = SceneFromBytes(bad.bytes, bad.name);
    EXPECT_FALSE(parsed.ok()) << bad.name;
    EXPECT_LE(parsed.diagnostics.size(), 300U) << bad.name;
  }
}

TEST(SceneBytesTest, GltfCutOffAnywhereIsRefused) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/gltf")) {
    for (std::size_t size = 0; size < seed.bytes.size(); ++size) {
      EXPECT_FALSE(SceneFromBytes(seed.bytes.substr(0, size), seed.name).ok())
          << seed.name << " " << size;
    }
  }
}

TEST(SceneBytesTest, MutatedGltfIsSoundOrRefused) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/gltf")) {
    int accepted = 0;
    for (std::uint64_t key = 0; key < 10'000; ++key) {
      SCOPED_TRACE(key);
      const ParsedScene parsed = SceneFromBytes(Mutated(seed.bytes, key), seed.name);
      ExpectSoundOrRefused(parsed);
      accepted += parsed.ok() ? 1 : 0;
    }
    EXPECT_GT(accepted, 100) << seed.name;
  }
}

TEST(SceneBytesTest, MutatedMitsubaScenesAreSoundOrRefused) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/mitsuba")) {
    EXPECT_TRUE(SceneFromBytes(seed.bytes, seed.name).ok()) << seed.name;
    int accepted = 0;
    for (std::uint64_t key = 0; key < 10'000; ++key) {
      SCOPED_TRACE(key);
      const ParsedScene parsed = SceneFromBytes(Mutated(seed.bytes, key), seed.name);
      ExpectSoundOrRefused(parsed);
      accepted += parsed.ok() ? 1 : 0;
    }
    EXPECT_GT(accepted, 100) << seed.name;
  }
}

TEST(SceneBytesTest, TheCorpusOfBadMitsubaScenesIsRefused) {
  const std::vector<NamedBytes> corpus = FilesOf("fuzz/corpus/mitsuba");
  EXPECT_GE(corpus.size(), 10U);
  for (const NamedBytes& bad : corpus) {
    const ParsedScene parsed = SceneFromBytes(bad.bytes, bad.name);
    EXPECT_FALSE(parsed.ok()) << bad.name;
    EXPECT_LE(parsed.diagnostics.size(), 300U) << bad.name;
  }
}

TEST(SceneBytesTest, MutatedMeshesAreSoundOrRefused) {
  for (const NamedBytes& seed : FilesOf("fuzz/seeds/ply")) {
    for (std::uint64_t key = 0; key < 20'000; ++key) {
      const StatusOr<TriangleMesh> mesh = ParsePly(Mutated(seed.bytes, key));
      if (!mesh.ok()) continue;
      // A mesh has no more than its bytes can pay for: 200 times, when packed.
      EXPECT_LE(mesh->positions.size(), 200 * (seed.bytes.size() + 1024)) << seed.name << key;
      for (const std::uint32_t index : mesh->indices) {
        ASSERT_LT(index, mesh->positions.size()) << seed.name << " " << key;
      }
      for (const Vec3 position : mesh->positions) {
        ASSERT_TRUE(IsFinite(position)) << seed.name << " " << key;
      }
    }
  }
}

TEST(SceneBytesTest, HostileNestingAndListsEnd) {
  const auto repeated = [](const std::string& text, int count) {
    std::string all = "Camera \"perspective\" WorldBegin\n";
    for (int i = 0; i < count; ++i)
      all += text;
    return all;
  };
  EXPECT_FALSE(SceneFromBytes(repeated("AttributeBegin\n", 50'000)).ok());
  EXPECT_FALSE(SceneFromBytes(repeated("Attribute \"shape\" \"float a\" 1\n", 10'000)).ok());
  EXPECT_FALSE(SceneFromBytes(repeated("Scale 1e30 1e30 1e30\n", 100)).ok());
  // A transform that flattens everything is none that a scene cannot have.
  EXPECT_TRUE(SceneFromBytes(repeated("Scale 1e-30 1e-30 1e-30\n", 100)).ok());
  EXPECT_FALSE(SceneFromBytes(repeated("Include \"fuzz.pbrt\"\n", 100)).ok());
  EXPECT_FALSE(SceneFromBytes(repeated("unknown [ \"words\" ]\n", 40'000)).ok());
  // Warned of, and at most a hundred times.
  std::string parameters = "Shape \"sphere\"";
  for (int i = 0; i < 40'000; ++i)
    parameters += " \"float p" + std::to_string(i) + "\" 1";
  const ParsedScene parsed = SceneFromBytes(repeated(parameters, 1));
  EXPECT_TRUE(parsed.ok());
  EXPECT_LE(parsed.diagnostics.size(), 102U);
}

}  // namespace
}  // namespace lucerna
