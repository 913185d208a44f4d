#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <unistd.h>
#include <vector>

#include "tfdude/description/urdf.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace {

using tfdude::testing::Random;

// Both streams of the process go to a file as long as this lives.
class Captured {
 public:
  Captured() : file_(std::tmpfile()), out_(dup(1)), err_(dup(2)) {
    std::fflush(nullptr);
    dup2(fileno(file_), 1);
    dup2(fileno(file_), 2);
  }
  Captured(const Captured&) = delete;
  Captured& operator=(const Captured&) = delete;
  ~Captured() { end(); }

  // @return how many bytes were printed
  long end() {
    if (file_ == nullptr) return 0;
    std::fflush(nullptr);
    dup2(out_, 1);
    dup2(err_, 2);
    close(out_);
    close(err_);
    const long size = static_cast<long>(lseek(fileno(file_), 0, SEEK_END));
    std::fclose(file_);
    file_ = nullptr;
    return size;
  }

 private:
  std::FILE* file_;
  int out_;
  int err_;
};

std::string read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Where an element or attribute begins and ends: from `open` to `close`, the first after some
// place. Empty: none.
std::pair<std::size_t, std::size_t> piece(const std::string& text, Random& random,
                                          const std::string& open, const std::string& close) {
  const std::size_t begin = text.find(open, random.index(text.size()));
  if (begin == std::string::npos) return {0, 0};
  const std::size_t end = text.find(close, begin + open.size());
  return end == std::string::npos ? std::pair<std::size_t, std::size_t>{0, 0}
                                  : std::pair{begin, end + close.size()};
}

// An element with all within it, a part of one, or an attribute.
std::pair<std::size_t, std::size_t> any_piece(const std::string& text, Random& random) {
  switch (random.index(4)) {
    case 0:
      return piece(text, random, "<joint", "</joint>");
    case 1:
      return piece(text, random, "<", ">");
    case 2:
      return piece(text, random, "=\"", "\"");
    default:
      return piece(text, random, " ", "\"");
  }
}

std::string mutated(std::string text, Random& random) {
  if (text.empty()) return text;
  static const std::vector<std::string> kValues = {
      "=\"nan\"",  "=\"1e308 -1e308 1e308\"", "=\"\"",      "=\"0 0 0\"",     "=\"-1e-310\"",
      "=\"1e10\"", "=\"continuous\"",         "=\"fixed\"", "=\"base_link\"", "=\"elbow_joint\"",
      "=\"%n%s\""};
  const auto [begin, end] = any_piece(text, random);
  const std::string part = text.substr(begin, end - begin);
  switch (random.index(7)) {
    case 0:
      text[random.index(text.size())] ^= static_cast<char>(1U << random.index(8));
      return text;
    case 1:
      return text.erase(random.index(text.size()), 1 + random.index(40));
    case 2:
      return text.erase(begin, end - begin);
    case 3:
      return text.insert(end, part);
    case 4: {
      const auto value = piece(text, random, "=\"", "\"");
      return text.replace(value.first, value.second - value.first,
                          kValues[random.index(kValues.size())]);
    }
    case 5: {
      const auto other = piece(text, random, "=\"", "\"");
      return text.replace(other.first, other.second - other.first,
                          part.rfind("=\"", 0) == 0 ? part : "=\"\"");
    }
    default: {
      const auto element = piece(text, random, "<joint", "</joint>");
      const std::string copy = text.substr(element.first, element.second - element.first);
      return text.insert(piece(text, random, "<joint", "</joint>").second, copy);
    }
  }
}

bool is_finite(const tfdude::Transform& X) { return tfdude::check_finite(X).has_value(); }

bool is_finite(const tfdude::FrameSpec& frame) {
  if (!is_finite(frame.X_PC)) return false;
  if (!frame.joint) return true;
  const auto& joint = *frame.joint;
  bool good = is_finite(joint.joint.X_PJ) && joint.joint.S.allFinite() &&
              std::isfinite(joint.position) && std::isfinite(joint.variance.value_or(0)) &&
              joint.variance.value_or(0) >= 0;
  if (joint.limits) good = good && std::isfinite(joint.limits->lower + joint.limits->upper);
  if (joint.mimic) good = good && std::isfinite(joint.mimic->multiplier + joint.mimic->offset);
  return good;
}

}  // namespace

TEST_CASE("urdf: mutated URDFs are read or rejected and nothing is printed") {
  Random random(20260);
  INFO("seed " << random.seed());
  int accepted = 0;
  int refused = 0;
  for (const std::string name : {"ur5e", "two_arms", "mobile_arm", "three_hinges"}) {
    const std::string original = read(TFDUDE_EXAMPLES "/robots/" + name + ".urdf");
    REQUIRE_FALSE(original.empty());
    for (int run = 0; run < 1000; ++run) {
      std::string text = original;
      const std::size_t count = 1 + random.index(2);
      for (std::size_t i = 0; i < count; ++i) text = mutated(std::move(text), random);
      Captured output;
      const auto frames = tfdude::parse_urdf(text, {"r.urdf"});
      const long printed = output.end();
      INFO(text);
      REQUIRE(printed == 0);
      if (!frames) {
        ++refused;
        REQUIRE(frames.error().message.rfind("r.urdf", 0) == 0);
        continue;
      }
      ++accepted;
      for (const auto& frame : *frames) REQUIRE(is_finite(frame));
    }
  }
  INFO("accepted " << accepted << ", refused " << refused);
  CHECK(accepted > 400);
  CHECK(refused > 400);
}
