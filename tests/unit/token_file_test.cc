// Which lines make a token known, and which are refused?
#include "render/base/token_file.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/base/secret.h"

namespace lucerna {
namespace {

TEST(TokenFileTest, ALineIsANameRolesAndADigest) {
  const std::string digest = Sha256("secret").Hex();
  const auto entries = ParseTokens("# people\n\nalice submit " + digest +
                                       "  # until May\r\n\tops admin,work " + Sha256("other").Hex(),
                                   "tokens");
  ASSERT_TRUE(entries.ok()) << entries.status();
  ASSERT_EQ(entries->size(), 2U);
  const TokenEntry* const alice = FindToken(*entries, "secret");
  ASSERT_NE(alice, nullptr);
  EXPECT_EQ(alice->name, "alice");
  EXPECT_TRUE(Has(alice->roles, Role::kSubmit));
  EXPECT_FALSE(Has(alice->roles, Role::kAdmin));
  EXPECT_EQ(FindToken(*entries, "other")->roles, 6);
  for (const char* wrong : {"", "Secret", "secret ", "secre", "alice"})
    EXPECT_EQ(FindToken(*entries, wrong), nullptr) << wrong;
  EXPECT_EQ(FindToken(*entries, digest), nullptr) << "the digest is no token";
}

TEST(TokenFileTest, OtherLinesAreErrorsWithTheirNumbers) {
  const std::string digest = Sha256("secret").Hex();
  for (const std::string& line : std::vector<std::string>{
           "alice submit", "alice submit abcd", "alice king " + digest, "alice submit, " + digest,
           "al/ice submit " + digest, std::string(65, 'a') + " submit " + digest,
           "alice submit " + digest + " more", "alice submit lucerna-" + digest,
           "alice submit " + digest.substr(1) + "g", "al\x1b[2Jice submit " + digest}) {
    const auto entries = ParseTokens("# one\n" + line + "\n", "tokens");
    ASSERT_FALSE(entries.ok()) << line;
    EXPECT_TRUE(entries.status().message().find("tokens:2: ") == 0) << entries.status();
  }
  EXPECT_TRUE(ParseTokens("", "tokens")->empty());
}

TEST(SecretTest, SecretsAreTheSameOrNot) {
  EXPECT_TRUE(IsSameSecret("abc", "abc"));
  EXPECT_FALSE(IsSameSecret("abc", "abd"));
  EXPECT_FALSE(IsSameSecret("abc", "abcd"));
  EXPECT_TRUE(IsSameSecret("", ""));
}

}  // namespace
}  // namespace lucerna
