// A report must draw in a real browser, in light and in dark, with no word of complaint and without
// asking anybody for anything.
//
// Skipped, and says so, where there is no chromium. The browser's own requests are kept from
// leaving the machine; those of the page are counted.
#include "render/report/report_page.h"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "gtest/gtest.h"

#include "render/base/files.h"
#include "render/formats/image_file.h"
#include "tests/support/converging_job.h"
#include "tests/support/process.h"

namespace lucerna {
namespace {

using Color = std::array<int, 3>;

std::string PathOfBrowser() {
  for (const char* path : {"/usr/bin/chromium", "/usr/bin/chromium-browser"}) {
    if (std::filesystem::exists(path)) return path;
  }
  return {};
}

class ReportPageInBrowserTest : public testing::Test {
 protected:
  ReportPageInBrowserTest() {
    std::string pattern = testing::TempDir() + "report_pageXXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  // After a failure the page is kept.
  ~ReportPageInBrowserTest() override {
    if (HasFailure()) {
      ADD_FAILURE() << "the page and its pictures are in " << folder_;
    } else {
      std::filesystem::remove_all(folder_);
    }
  }

  void SetUp() override {
    if (PathOfBrowser().empty()) {
      GTEST_SKIP() << "chromium is not installed; `bash deploy/packages.sh tests` does that";
    }
  }

  [[nodiscard]] std::string In(const std::string& name) const { return folder_ + "/" + name; }

  struct Visit {
    std::string dom;
    std::string console;  // lines that the page caused
    bool asked = false;   // for anything beyond its own file
    Picture picture;
  };
  // Opens the page as a reader would.
  [[nodiscard]] Visit Open(const std::string& page, bool is_dark) const {
    EXPECT_TRUE(WriteFile(In("page.html"), page).ok());
    Visit visit;
    const std::vector<std::string> browser = {
        PathOfBrowser(),
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-extensions",
        "--hide-scrollbars",
        "--window-size=1280,2400",
        "--enable-logging=stderr",
        "--host-resolver-rules=MAP * ~NOTFOUND",
        "--user-data-dir=" + In("profile"),
        "--log-net-log=" + In("requests.json"),
        std::string("--blink-settings=preferredColorScheme=") + (is_dark ? "0" : "1")};
    for (const std::string what : {"--dump-dom", "--screenshot"}) {
      std::vector<std::string> command = browser;
      command.push_back(what == "--screenshot" ? "--screenshot=" + In("page.png") : what);
      command.push_back("file://" + In("page.html"));
      const Finished finished = RunProgram(command);
      EXPECT_EQ(finished.exit_code, 0) << finished.errors;
      if (what == "--dump-dom") visit.dom = finished.output;
      for (std::size_t at = 0; at < finished.errors.size();) {
        const std::size_t end = std::min(finished.errors.find('\n', at), finished.errors.size());
        const std::string line = finished.errors.substr(at, end - at);
        if (line.find("CONSOLE") != std::string::npos) visit.console += line + "\n";
        at = end + 1;
      }
      const auto requests = ReadFile(In("requests.json"));
      EXPECT_TRUE(requests.ok()) << requests.status();
      // A page's requests carry its origin; the browser's own have none or another.
      visit.asked =
          visit.asked || requests->find("\"network_isolation_key\":\"file:") != std::string::npos;
    }
    const auto png = ReadFile(In("page.png"));
    EXPECT_TRUE(png.ok()) << png.status();
    auto picture = ReadPicture(*png, "page.png", PixelEncoding{}, std::uint64_t{1} << 30);
    EXPECT_TRUE(picture.ok()) << picture.status();
    visit.picture = *std::move(picture);
    return visit;
  }

  static Color ColorAt(const Picture& picture, std::size_t pixel) {
    const std::size_t at = 3 * pixel;
    return {picture.coded[at], picture.coded[at + 1], picture.coded[at + 2]};
  }
  static int PixelsOf(const Picture& picture, const Color& color) {
    int count = 0;
    for (std::size_t i = 0; i < picture.coded.size() / 3; ++i)
      count += ColorAt(picture, i) == color ? 1 : 0;
    return count;
  }

  static std::string PageOfTests() {
    const auto png = ReadFile(std::string(LUCERNA_SOURCE_DIR) + "/docs/caustic.png");
    EXPECT_TRUE(png.ok()) << png.status();
    return ReportPage(ConvergingJob(), PageImage{*png, Sha256(*png)});
  }

  std::string folder_;
};

TEST_F(ReportPageInBrowserTest, DrawsInLightAndDarkAndAsksForNothing) {
  struct Look {
    bool is_dark;
    Color paper, estimate;  // of ReportPage's style and ChartCss
  };
  for (const Look& look : {Look{false, {0xFF, 0xFF, 0xFF}, {0x00, 0x67, 0xA5}},
                           Look{true, {0x14, 0x17, 0x1A}, {0x56, 0xB4, 0xE9}}}) {
    SCOPED_TRACE(look.is_dark ? "dark" : "light");
    const Visit visit = Open(PageOfTests(), look.is_dark);
    EXPECT_EQ(visit.console, "");
    EXPECT_FALSE(visit.asked);
    EXPECT_NE(visit.dom.find("Error against photons"), std::string::npos);
    EXPECT_NE(visit.dom.find("render-3:4213"), std::string::npos);
    ASSERT_EQ(visit.picture.width, 1280);
    // A good part of the page is paper. The two legends alone have at most 22 × 3 pixels each of
    // the estimate's full colour; the edges of lines are blended and do not count.
    EXPECT_EQ(ColorAt(visit.picture, 0), look.paper);
    EXPECT_GT(PixelsOf(visit.picture, look.paper), 1280 * 2400 / 4);
    EXPECT_GT(PixelsOf(visit.picture, look.estimate), 2 * 22 * 3);
  }
}

TEST_F(ReportPageInBrowserTest, APageWithoutAnythingDrawsToo) {
  const Visit visit = Open(ReportPage(v1::Job(), std::nullopt), /*is_dark=*/false);
  EXPECT_EQ(visit.console, "");
  EXPECT_FALSE(visit.asked);
  EXPECT_NE(visit.dom.find("There is no image."), std::string::npos);
}

// The tests above would be worth nothing if these faults went unseen.
TEST_F(ReportPageInBrowserTest, PlantedFaultsAreSeen) {
  std::string page = PageOfTests();
  const std::string planted =
      "<img src=\"http://127.0.0.1:9/a.png\" alt=\"\"><script>console.log(1)</script></main>";
  page.replace(page.find("</main>"), 7, planted);
  const Visit forbidden = Open(page, /*is_dark=*/false);
  EXPECT_NE(forbidden.console.find("Content Security Policy"), std::string::npos);
  EXPECT_FALSE(forbidden.asked) << "the page forbids itself to ask";

  const std::size_t policy = page.find("<meta http-equiv");
  page.erase(policy, page.find('>', policy) + 1 - policy);
  EXPECT_TRUE(Open(page, /*is_dark=*/false).asked);
}

}  // namespace
}  // namespace lucerna
