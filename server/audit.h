// Which batches are computed by two workers, and whose result is right?
//
// Results are deterministic: two workers that did the same batch return the same bytes. Of an
// audited batch no result counts until two different workers have returned the same digest; whoever
// returned another one was wrong. Only digests are kept, because the second of two equal results
// brings the bytes.
//
// Which batches are audited follows from a secret of this process, so a worker cannot know.
//
// Pure values.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/base/clock.h"
#include "render/base/digest.h"
#include "server/batch.h"

namespace lucerna {

// What came of the audit of a batch: nothing yet, or it is not audited; two results were equal; no
// other worker was there; two results differed.
enum class AuditOutcome : std::uint8_t { kNone, kAgreed, kNotAudited, kDisputed };

// Whether this batch is one of the `share` in [0, 1] that are audited.
[[nodiscard]] bool IsAudited(std::string_view secret, double share, const PassKey& pass,
                             WorkKind kind, WorkRange range);

// The results of one batch so far.
class Audit {
 public:
  explicit Audit(SteadyTime began_at) : began_at_(began_at) {}

  [[nodiscard]] SteadyTime began_at() const { return began_at_; }
  // Adds a worker's result; the first of a worker counts. Returns whether two agree now.
  bool Add(const std::string& worker, const Digest& result);
  // Of an audit in which no two agree: the worker has no part in it any more.
  void Remove(const std::string& worker) { results_.erase(worker); }
  [[nodiscard]] bool HasResultOf(const std::string& worker) const {
    return results_.contains(worker);
  }
  [[nodiscard]] const std::map<std::string, Digest>& results() const { return results_; }
  // Workers whose result is not the one that two agree on. Requires that Add returned true.
  [[nodiscard]] std::vector<std::string> Wrong() const;
  // Two results or more and no two agree: another worker decides.
  [[nodiscard]] bool is_disputed() const { return results_.size() > 1 && !agreed_; }

 private:
  SteadyTime began_at_;
  std::map<std::string, Digest> results_;  // by worker
  std::optional<Digest> agreed_;
};

}  // namespace lucerna
