// Which bytes does the coordinator keep on its disk, by their digest?
//
// Scene files and images of the jobs that are kept. A blob is a file named by its digest. It is
// written beside its name, synced and renamed, so that a crash leaves a whole blob or none; what is
// read is compared with its digest, so that torn or flipped bytes are never used.
//
// Threads: any.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "render/base/digest.h"
#include "render/base/status.h"
#include "server/state/disk_budget.h"

namespace lucerna {

class BlobFiles {
 public:
  // Makes the folder unless it is there, and removes what a crash left unfinished.
  // Errors: what the system said.
  [[nodiscard]] static StatusOr<std::unique_ptr<BlobFiles>> Open(
      const std::string& folder,
      std::shared_ptr<DiskBudget> budget = std::make_shared<DiskBudget>());

  // Keeps `bytes`, whose digest the caller has made sure of. A damaged blob of that digest is
  // replaced. Errors: as DiskBudget::Write.
  [[nodiscard]] Status Put(const Digest& digest, std::string_view bytes);
  // Errors: NOT_FOUND; DATA_LOSS when the file does not have that digest, and then it is removed.
  [[nodiscard]] StatusOr<std::string> Get(const Digest& digest) const;
  // Whether there is such a file, damaged or not.
  [[nodiscard]] bool Has(const Digest& digest) const;

  // Removes all blobs but these.
  void KeepOnly(const std::set<Digest>& needed);
  // Of those of `digests` that are there [bytes].
  [[nodiscard]] std::uint64_t SizeOf(const std::set<Digest>& digests) const;

 private:
  BlobFiles(std::string folder, std::shared_ptr<DiskBudget> budget)
      : folder_(std::move(folder)), budget_(std::move(budget)) {}
  [[nodiscard]] std::string PathOf(const Digest& digest) const;

  const std::string folder_;
  const std::shared_ptr<DiskBudget> budget_;
};

}  // namespace lucerna
