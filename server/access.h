// Who is calling, and may they?
//
// The one place that decides what role each method needs. It is gRPC's authentication processor, so
// it sees every call before its handler does, of services that do not exist yet too: a method that
// is not in the table is refused.
//
// Without a file of tokens everybody who can connect may do everything.
//
// Threads: any.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <grpcpp/grpcpp.h>

#include "render/base/clock.h"
#include "render/base/mutex.h"
#include "render/base/status.h"
#include "render/base/token_file.h"

namespace lucerna {

// Whom a call comes from.
struct Caller {
  // Of the token; without tokens the common name of the certificate. Empty: unknown.
  std::string name;
  Roles roles = kAllRoles;

  // What belongs to nobody is for admins.
  [[nodiscard]] bool MayChangeWhatIsOf(std::string_view owner) const {
    return Has(roles, Role::kAdmin) || (!name.empty() && name == owner);
  }
};

// The roles of which a caller of a method ("/package.Service/Method") needs one; absent: there is
// no such method. kAllRoles with `is_open`: no token is needed at all.
struct MethodRule {
  Roles roles = 0;
  bool is_open = false;
};
[[nodiscard]] std::optional<MethodRule> RuleOf(std::string_view method);

class Access {
 public:
  // `tokens_path` empty: no tokens.
  // Errors: a file that cannot be read, that every user may read, or with a line that is none.
  [[nodiscard]] static StatusOr<std::unique_ptr<Access>> Open(std::string tokens_path);

  // Everybody may do everything.
  [[nodiscard]] static const Access& Unrestricted();

  [[nodiscard]] bool has_tokens() const { return !path_.empty(); }

  // OK, UNAUTHENTICATED without a token that is known, PERMISSION_DENIED without a role that the
  // method needs. `authorization` is the header of that name; empty: none.
  [[nodiscard]] Status Check(std::string_view method, std::string_view authorization) const;

  // The caller of a handler, which Check has let through.
  [[nodiscard]] Caller CallerOf(const grpc::ServerContextBase& context) const;

  // Whose limits a call counts for: the caller's name, or for one without the address of its
  // machine.
  [[nodiscard]] std::string LimitKeyOf(const grpc::CallbackServerContext& context) const;

  // Whether the caller may change this job, or have its image: PERMISSION_DENIED unless they are
  // its owner or an admin.
  [[nodiscard]] Status CheckOwns(const grpc::ServerContextBase& context, const std::string& job_id,
                                 const std::string& owner) const;

  // For server credentials; the Access outlives them.
  [[nodiscard]] std::shared_ptr<grpc::AuthMetadataProcessor> MakeProcessor() const;

  // Reads the file again when it has changed. Errors: as Open; then the tokens stay as they were.
  // Returns true when there are new ones.
  [[nodiscard]] StatusOr<bool> Reread();

 private:
  using Entries = std::shared_ptr<const std::vector<TokenEntry>>;

  explicit Access(std::string tokens_path) : path_(std::move(tokens_path)) {}
  [[nodiscard]] Entries entries() const;

  const std::string path_;
  mutable Mutex mutex_;
  Entries entries_ LUCERNA_GUARDED_BY(mutex_);
  std::string read_text_ LUCERNA_GUARDED_BY(mutex_);
  Status read_status_ LUCERNA_GUARDED_BY(mutex_);
};

}  // namespace lucerna
