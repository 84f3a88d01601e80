// What reads bytes from outside, and which bytes does it read well?
//
// Each target is a reader of files, messages or checkpoints, with what must hold of a value that it
// accepts; the process ends when that does not hold. libFuzzer runs one target in a program
// (fuzz_main.cpp); the tests run all of them on tests/fuzz/corpus/found (corpus_test.cc).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lucerna {

struct FuzzTarget {
  const char* name;  // of its program and of its folder of inputs
  // Returns whether the bytes were accepted.
  bool (*read)(std::string_view bytes);
  // Bytes that are accepted, made by today's writers or taken from tests/fuzz/seeds.
  std::vector<std::string> (*seeds)();
};

// All, in documentation order.
[[nodiscard]] std::span<const FuzzTarget> AllFuzzTargets();

// scene_targets.cc
bool FuzzPbrt(std::string_view bytes);
std::vector<std::string> PbrtSeeds();
bool FuzzMitsuba(std::string_view bytes);
std::vector<std::string> MitsubaSeeds();
bool FuzzObj(std::string_view bytes);
std::vector<std::string> ObjSeeds();
bool FuzzGltf(std::string_view bytes);
std::vector<std::string> GltfSeeds();
bool FuzzPly(std::string_view bytes);
std::vector<std::string> PlySeeds();
bool FuzzView(std::string_view bytes);
std::vector<std::string> ViewSeeds();
bool FuzzSensors(std::string_view bytes);
std::vector<std::string> SensorsSeeds();
bool FuzzMeasured(std::string_view bytes);
std::vector<std::string> MeasuredSeeds();
bool FuzzImage(std::string_view bytes);
std::vector<std::string> ImageSeeds();

// codec_targets.cc. The first byte chooses what the receiver expects: sizes, and features.
bool FuzzAccumulation(std::string_view bytes);
std::vector<std::string> AccumulationSeeds();
bool FuzzBlock(std::string_view bytes);
std::vector<std::string> BlockSeeds();
bool FuzzRadii(std::string_view bytes);
std::vector<std::string> RadiiSeeds();
bool FuzzSlice(std::string_view bytes);
std::vector<std::string> SliceSeeds();
bool FuzzGuide(std::string_view bytes);
std::vector<std::string> GuideSeeds();

// state_targets.cc. An odd first byte of a checkpoint makes its digests right before it is read.
bool FuzzCheckpoint(std::string_view bytes);
std::vector<std::string> CheckpointSeeds();
bool FuzzSums(std::string_view bytes);
std::vector<std::string> SumsSeeds();
bool FuzzRecord(std::string_view bytes);
std::vector<std::string> RecordSeeds();

// message_targets.cc. The first byte chooses the message of FuzzMessages.
bool FuzzManifest(std::string_view bytes);
std::vector<std::string> ManifestSeeds();
bool FuzzMessages(std::string_view bytes);
std::vector<std::string> MessagesSeeds();

}  // namespace lucerna
