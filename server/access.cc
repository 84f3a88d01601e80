#include "server/access.h"

#include <map>
#include <utility>

#include "render/base/files.h"
#include "render/base/secret.h"
#include "render/wire/grpc_status.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kLargestTokenFile = std::uint64_t{16} << 20;
constexpr std::string_view kBearer = "Bearer ";

constexpr Roles kSubmit = static_cast<Roles>(Role::kSubmit) | static_cast<Roles>(Role::kAdmin);
constexpr Roles kWork = static_cast<Roles>(Role::kWork) | static_cast<Roles>(Role::kAdmin);
constexpr Roles kAdmin = static_cast<Roles>(Role::kAdmin);

const std::map<std::string_view, MethodRule>& Rules() {
  static const std::map<std::string_view, MethodRule> rules = {
      {"/lucerna.v1.AdminService/DrainWorker", {kAdmin}},
      {"/lucerna.v1.AdminService/ListWorkers", {kAdmin}},
      {"/lucerna.v1.AdminService/QuarantineWorker", {kAdmin}},
      {"/lucerna.v1.AdminService/ReleaseWorker", {kAdmin}},
      {"/lucerna.v1.AssetService/FindMissing", {kSubmit}},
      {"/lucerna.v1.AssetService/Upload", {kSubmit}},
      {"/lucerna.v1.ImageService/GetImage", {kSubmit}},
      {"/lucerna.v1.ImageService/GetTrace", {kSubmit}},
      {"/lucerna.v1.JobService/Cancel", {kSubmit}},
      {"/lucerna.v1.JobService/Delete", {kSubmit}},
      {"/lucerna.v1.JobService/Extend", {kSubmit}},
      {"/lucerna.v1.JobService/Get", {kSubmit}},
      {"/lucerna.v1.JobService/List", {kSubmit}},
      {"/lucerna.v1.JobService/Pause", {kSubmit}},
      {"/lucerna.v1.JobService/Resume", {kSubmit}},
      {"/lucerna.v1.JobService/SetPriority", {kSubmit}},
      {"/lucerna.v1.JobService/Stop", {kSubmit}},
      {"/lucerna.v1.JobService/Submit", {kSubmit}},
      {"/lucerna.v1.JobService/Watch", {kSubmit}},
      {"/lucerna.v1.WorkerService/CommitBatch", {kWork}},
      // Also for `lucerna trace-photon`, which traces a photon of the caller's own job again.
      {"/lucerna.v1.WorkerService/DescribeJob", {kWork | kSubmit}},
      {"/lucerna.v1.WorkerService/FetchBlob", {kWork | kSubmit}},
      {"/lucerna.v1.WorkerService/Goodbye", {kWork}},
      {"/lucerna.v1.WorkerService/Register", {kWork}},
      {"/lucerna.v1.WorkerService/Sync", {kWork}},
      // Whether the process serves, and what its protocol is: known to everybody anyway.
      {"/grpc.health.v1.Health/Check", {kAllRoles, true}},
      {"/grpc.health.v1.Health/Watch", {kAllRoles, true}},
      {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", {kAllRoles, true}},
  };
  return rules;
}

std::string_view ViewOf(const grpc::string_ref& text) {
  return {text.data(), text.size()};
}

std::string NameOf(Roles roles) {
  // An admin may do all; what is said is the smallest role that is enough.
  if (Has(roles, Role::kSubmit)) return "submit";
  return Has(roles, Role::kWork) ? "work" : "admin";
}

// The token of an authorization header; empty when it has none.
std::string_view TokenIn(std::string_view authorization) {
  return authorization.starts_with(kBearer) ? authorization.substr(kBearer.size())
                                            : std::string_view();
}

class Processor final : public grpc::AuthMetadataProcessor {
 public:
  explicit Processor(const Access& access) : access_(access) {}
  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* /*context*/,
                       OutputMetadata* /*consumed*/, OutputMetadata* /*response*/) override {
    const auto method = metadata.find(":path");
    const auto authorization = metadata.find("authorization");
    return ToGrpc(access_.Check(
        method == metadata.end() ? std::string_view() : ViewOf(method->second),
        authorization == metadata.end() ? std::string_view() : ViewOf(authorization->second)));
  }

 private:
  const Access& access_;
};

}  // namespace

std::optional<MethodRule> RuleOf(std::string_view method) {
  // Whatever an administrator's service offers is for administrators.
  if (method.starts_with("/lucerna.v1.AdminService/")) return MethodRule{kAdmin};
  const auto found = Rules().find(method);
  if (found == Rules().end()) return std::nullopt;
  return found->second;
}

StatusOr<std::unique_ptr<Access>> Access::Open(std::string tokens_path) {
  auto access = std::unique_ptr<Access>(new Access(std::move(tokens_path)));
  if (access->has_tokens()) LUCERNA_RETURN_IF_ERROR(access->Reread().status());
  return access;
}

StatusOr<bool> Access::Reread() {
  if (!has_tokens()) return false;
  std::string text;
  const auto read = [&]() -> StatusOr<std::vector<TokenEntry>> {
    LUCERNA_RETURN_IF_ERROR(CheckPrivate(path_));
    LUCERNA_ASSIGN_OR_RETURN(text, ReadFile(path_, kLargestTokenFile));
    return ParseTokens(text, path_);
  };
  StatusOr<std::vector<TokenEntry>> entries = read();
  const MutexLock lock(mutex_);
  // The same error once, not at every look.
  const bool is_new_error = entries.status() != read_status_;
  read_status_ = entries.status();
  if (!entries.ok()) return is_new_error ? StatusOr<bool>(entries.status()) : false;
  if (entries_ && text == read_text_) return false;
  read_text_ = std::move(text);
  entries_ = std::make_shared<const std::vector<TokenEntry>>(*std::move(entries));
  return true;
}

Access::Entries Access::entries() const {
  const MutexLock lock(mutex_);
  return entries_;
}

Status Access::Check(std::string_view method, std::string_view authorization) const {
  if (!has_tokens()) return absl::OkStatus();
  const std::optional<MethodRule> rule = RuleOf(method);
  if (!rule) return absl::UnimplementedError("this coordinator has no such method");
  if (rule->is_open) return absl::OkStatus();
  const std::string_view token = TokenIn(authorization);
  if (token.empty()) {
    return absl::UnauthenticatedError(
        "the coordinator asks for a token; give --token-file FILE or LUCERNA_TOKEN");
  }
  const Entries known = entries();
  const TokenEntry* const entry = FindToken(*known, token);
  if (entry == nullptr) {
    return absl::UnauthenticatedError("the coordinator does not know this token");
  }
  if ((entry->roles & rule->roles) == 0) {
    return absl::PermissionDeniedError(absl::StrCat(
        "the token of ", entry->name, " does not have the role ", NameOf(rule->roles)));
  }
  return absl::OkStatus();
}

Caller Access::CallerOf(const grpc::ServerContextBase& context) const {
  Caller caller;
  if (!has_tokens()) {
    const auto identity = context.auth_context();
    if (!identity) return caller;
    const auto names = identity->FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
    if (!names.empty()) caller.name = std::string(ViewOf(names.front()));
    return caller;
  }
  caller.roles = 0;
  const auto authorization = context.client_metadata().find("authorization");
  if (authorization == context.client_metadata().end()) return caller;
  const Entries known = entries();
  // Absent when the token was taken out of the file a moment ago.
  if (const TokenEntry* const entry = FindToken(*known, TokenIn(ViewOf(authorization->second)))) {
    caller = {entry->name, entry->roles};
  }
  return caller;
}

std::string Access::LimitKeyOf(const grpc::CallbackServerContext& context) const {
  const std::string name = CallerOf(context).name;
  if (!name.empty()) return absl::StrCat("caller ", name);
  // "ipv4:10.0.0.7:51234".
  const std::string peer = context.peer();
  return peer.substr(0, peer.rfind(':'));
}

Status Access::CheckOwns(const grpc::ServerContextBase& context, const std::string& job_id,
                         const std::string& owner) const {
  if (CallerOf(context).MayChangeWhatIsOf(owner)) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat("job ", job_id, " is of ",
                                                  owner.empty() ? "nobody that is known" : owner,
                                                  "; only its owner and admins may do this"));
}

const Access& Access::Unrestricted() {
  static const Access access{std::string()};
  return access;
}

std::shared_ptr<grpc::AuthMetadataProcessor> Access::MakeProcessor() const {
  return std::make_shared<Processor>(*this);
}

}  // namespace lucerna
