// Any bytes as what a coordinator kept on its disk: no crash, no hang, no memory without bound, and
// what is accepted is written as it was read.
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <utility>

#include "render/analysis/needs.h"
#include "render/base/digest.h"
#include "render/base/files.h"
#include "render/estimate/evidence.h"
#include "server/job_estimator.h"
#include "server/job_message.h"
#include "server/state/checkpoint_files.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/fuzz/scene_from_bytes.h"

namespace lucerna {
namespace {

constexpr const char* kJob = "job";

// A folder of this process for one job's checkpoints.
class CheckpointFolder {
 public:
  CheckpointFolder() : path_(std::filesystem::temp_directory_path() / "lucerna_fuzz_XXXXXX") {
    LUCERNA_CHECK(::mkdtemp(path_.data()) != nullptr);
    files_ = CheckpointFiles::Open(path_).value();
  }
  ~CheckpointFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  CheckpointFolder(const CheckpointFolder&) = delete;
  CheckpointFolder& operator=(const CheckpointFolder&) = delete;

  [[nodiscard]] CheckpointFiles& files() { return *files_; }
  // That of the job, in the first of its two places.
  [[nodiscard]] std::string file() const { return path_ + "/" + kJob + ".0"; }

 private:
  std::string path_;
  std::unique_ptr<CheckpointFiles> files_;
};

// Behind the first line come pieces: 8 bytes of length, the digest, the bytes.
std::string WithRightDigests(std::string_view bytes) {
  std::string result(bytes);
  constexpr std::size_t kLengthBytes = 8;
  std::size_t at = result.find('\n');
  if (at == std::string::npos) return result;
  ++at;
  while (at + kLengthBytes + Digest::kSize <= result.size()) {
    std::uint64_t length = 0;
    std::memcpy(&length, result.data() + at, kLengthBytes);
    const std::size_t piece = at + kLengthBytes + Digest::kSize;
    if (length > result.size() - piece) break;
    const Digest digest = Sha256(std::string_view(result).substr(piece, length));
    result.replace(at + kLengthBytes, Digest::kSize, digest.Bytes());
    at = piece + length;
  }
  return result;
}

// An estimator of eight pixels that has not begun.
std::unique_ptr<JobEstimator> SmallEstimator() {
  ParsedScene parsed = SceneFromBytes(
      "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 2\n"
      "Camera \"perspective\"\nWorldBegin\n"
      "LightSource \"point\" \"point3 from\" [0 1 0]\nTranslate 0 0 4\nShape \"sphere\"\n");
  LUCERNA_CHECK(parsed.ok());
  RenderSettings settings = ResolveSettings({}, parsed.scene).value();
  settings.adaptive_photons = true;
  SceneNeeds needs = NeedsOf(parsed.scene, settings);
  return JobEstimator::Create(std::move(parsed.scene), settings, std::move(needs), 1).value();
}

std::string Saved(const JobEstimator& estimator) {
  ByteWriter writer;
  estimator.Save(writer);
  return writer.Take();
}

Status Restore(JobEstimator& estimator, std::string_view bytes) {
  ByteReader reader(bytes);
  return estimator.Restore(reader);
}

Moment SomeMoment() {
  Moment moment;
  moment.now = SteadyTime(std::chrono::hours(1));
  moment.wall = WallTime(std::chrono::hours(24 * 365 * 50));
  return moment;
}

}  // namespace

bool FuzzCheckpoint(std::string_view bytes) {
  if (bytes.empty()) return false;
  const bool is_mended = static_cast<std::uint8_t>(bytes.front()) % 2 == 1;
  bytes.remove_prefix(1);
  static CheckpointFolder folder;
  // Not WriteFile, which waits for the disk.
  std::ofstream(folder.file(), std::ios::binary)
      << (is_mended ? WithRightDigests(bytes) : std::string(bytes));
  std::size_t whole = 0;
  const std::vector<std::string> damaged =
      folder.files().Read(kJob, [&](const Checkpoint& checkpoint) {
        ++whole;
        LUCERNA_CHECK(checkpoint.numeric_profile.size() + checkpoint.record.size() +
                          checkpoint.sums.size() <
                      bytes.size());
        return true;
      });
  LUCERNA_CHECK(whole + damaged.size() == 1);
  return whole == 1;
}

std::vector<std::string> CheckpointSeeds() {
  CheckpointFolder folder;
  LUCERNA_CHECK(folder.files().Write(kJob, {"profile", "the record", {"the sums"}}).ok());
  const std::string written = ReadFile(folder.file()).value();
  return {std::string(1, '\0') + written, std::string(1, '\1') + written};
}

bool FuzzSums(std::string_view bytes) {
  static JobEstimator& estimator = *SmallEstimator().release();
  static const std::string& before = *new std::string(Saved(estimator));
  if (!Restore(estimator, bytes).ok()) return false;
  // Numbers may have been written with more bytes than they need.
  const std::string again = Saved(estimator);
  LUCERNA_CHECK(again.size() <= bytes.size());
  LUCERNA_CHECK(Restore(estimator, again).ok() && Saved(estimator) == again);
  LUCERNA_CHECK(Restore(estimator, before).ok());
  return true;
}

std::vector<std::string> SumsSeeds() {
  const std::unique_ptr<JobEstimator> estimator = SmallEstimator();
  std::vector<std::string> seeds = {Saved(*estimator)};
  for (std::uint64_t pass = 0; pass < 3; ++pass) {
    EyePass now = estimator->TraceEyePaths(pass).value();
    const std::size_t rows = now.block.size();
    const RoundPlan plan = estimator->PlanFor(RoundOf(pass)).value();
    const std::size_t columns =
        EvidenceColumns(EvidenceOf(RenderSettings().radius_controller, pass));
    estimator->AddRound(std::make_shared<const SliceSums>(
                            estimator->SliceOf(std::move(now), plan, PassSums(rows, columns))),
                        plan);
  }
  seeds.push_back(Saved(*estimator));
  return seeds;
}

bool FuzzRecord(std::string_view bytes) {
  const auto record = DecodeRecord(std::string(bytes), SomeMoment());
  if (!record.ok()) return false;
  const std::string again = EncodeRecord(record->job, record->image, record->running);
  LUCERNA_CHECK(DecodeRecord(again, SomeMoment()).ok());
  return true;
}

std::vector<std::string> RecordSeeds() {
  Job job;
  job.id = "j1";
  job.name = "a job";
  job.owner = "somebody";
  job.manifest.main_path = "scene.pbrt";
  job.manifest.entries["scene.pbrt"] = {Sha256("scene"), 5};
  job.scene_digest = job.manifest.SceneDigest();
  job.settings.width = job.settings.crop_x1 = 64;
  job.settings.height = job.settings.crop_y1 = 48;
  job.settings.passes = 7;
  job.settings.initial_radius = 0.5;
  job.warnings = {"a warning"};
  job.counters.passes = 3;
  job.counters.photons = 3000;
  job.convergence.resize(2);
  job.lights.resize(1);
  job.photon_steps = {{0, 1000}};
  job.workers["w1"] = {"a worker", 3000, 3, std::chrono::seconds(2)};
  job.AddEvent(SomeMoment().wall, "paused");
  job.pass_record.Add({}, 3);
  Job waiting;
  waiting.id = "j2";
  waiting.manifest = job.manifest;
  return {EncodeRecord(job, Sha256("image"), std::chrono::seconds(5)),
          EncodeRecord(waiting, std::nullopt, {})};
}

}  // namespace lucerna
