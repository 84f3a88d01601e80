// Which bytes does the coordinator keep on its disk, by their digest?
//
// Scene files and images of the jobs that are kept. A blob is a file named by its digest. It is
// written beside its name, synced and renamed, so that a crash leaves a whole blob or none; what is
// read is compared with its digest, so that torn or flipped bytes are never used.
//
// Threads: any.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "render/base/digest.h"
#include "render/base/status.h"

namespace lucerna {

class BlobFiles {
 public:
  // Makes the folder unless it is there, and removes what a crash left unfinished.
  // Errors: what the system said.
  [[nodiscard]] static StatusOr<std::unique_ptr<BlobFiles>> Open(const std::string& folder);

  // Keeps `bytes`, whose digest the caller has made sure of. A damaged blob of that digest is
  // replaced. Errors: as WriteFile.
  [[nodiscard]] Status Put(const Digest& digest, std::string_view bytes);
  // Errors: NOT_FOUND; DATA_LOSS when the file does not have that digest, and then it is removed.
  [[nodiscard]] StatusOr<std::string> Get(const Digest& digest) const;
  // Whether there is such a file, damaged or not.
  [[nodiscard]] bool Has(const Digest& digest) const;

  // Removes all blobs but these.
  void KeepOnly(const std::set<Digest>& needed);

 private:
  explicit BlobFiles(std::string folder) : folder_(std::move(folder)) {}
  [[nodiscard]] std::string PathOf(const Digest& digest) const;

  const std::string folder_;
};

}  // namespace lucerna
