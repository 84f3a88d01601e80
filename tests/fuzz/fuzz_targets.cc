#include "tests/fuzz/fuzz_targets.h"

#include <array>

namespace lucerna {

std::span<const FuzzTarget> AllFuzzTargets() {
  static constexpr std::array kTargets = {
      FuzzTarget{"pbrt", FuzzPbrt, PbrtSeeds},
      FuzzTarget{"gltf", FuzzGltf, GltfSeeds},
      FuzzTarget{"mitsuba", FuzzMitsuba, MitsubaSeeds},
      FuzzTarget{"obj", FuzzObj, ObjSeeds},
      FuzzTarget{"ply", FuzzPly, PlySeeds},
      FuzzTarget{"view", FuzzView, ViewSeeds},
      FuzzTarget{"sensors", FuzzSensors, SensorsSeeds},
      FuzzTarget{"measured", FuzzMeasured, MeasuredSeeds},
      FuzzTarget{"image", FuzzImage, ImageSeeds},
      FuzzTarget{"accumulation", FuzzAccumulation, AccumulationSeeds},
      FuzzTarget{"block", FuzzBlock, BlockSeeds},
      FuzzTarget{"radii", FuzzRadii, RadiiSeeds},
      FuzzTarget{"slice", FuzzSlice, SliceSeeds},
      FuzzTarget{"guide", FuzzGuide, GuideSeeds},
      FuzzTarget{"checkpoint", FuzzCheckpoint, CheckpointSeeds},
      FuzzTarget{"sums", FuzzSums, SumsSeeds},
      FuzzTarget{"record", FuzzRecord, RecordSeeds},
      FuzzTarget{"manifest", FuzzManifest, ManifestSeeds},
      FuzzTarget{"messages", FuzzMessages, MessagesSeeds},
  };
  return kTargets;
}

}  // namespace lucerna
