#include "server/audit.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "absl/strings/str_cat.h"

namespace lucerna {

bool IsAudited(std::string_view secret, double share, const PassKey& pass, WorkKind kind,
               WorkRange range) {
  if (share <= 0) return false;
  const Digest digest =
      Sha256(absl::StrCat(std::string(secret), "\n", pass.job_id, "\n", pass.pass, "\n",
                          static_cast<int>(kind), "\n", range.first, "\n", range.last));
  std::uint64_t number = 0;
  std::memcpy(&number, digest.Bytes().data(), sizeof(number));
  return static_cast<double>(number) < share * 0x1p64;
}

bool Audit::Add(const std::string& worker, const Digest& result) {
  const bool is_new = results_.emplace(worker, result).second;
  if (agreed_ || !is_new) return agreed_.has_value();
  const auto agrees = [&](const auto& other) {
    return other.first != worker && other.second == result;
  };
  if (std::ranges::any_of(results_, agrees)) agreed_ = result;
  return agreed_.has_value();
}

std::vector<std::string> Audit::Wrong() const {
  std::vector<std::string> wrong;
  for (const auto& [worker, result] : results_) {
    if (result != *agreed_) wrong.push_back(worker);
  }
  return wrong;
}

}  // namespace lucerna
