#include "tfdude/base/id.hpp"

#include <string>

#include "support/catch.hpp"

namespace tfdude {
namespace {

// The message of a rejection; empty where the id is accepted.
std::string refusal(std::string_view id) {
  const auto ok = check_id(id, "child");
  if (ok) return "";
  CHECK(ok.error().code == Errc::kInvalidInput);
  return ok.error().message;
}

bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

TEST_CASE("ids of ordinary text are accepted") {
  const std::string id = GENERATE(as<std::string>{}, "a", "base_link", "arm/left 1", "~!@#$%^&()",
                                  "\xC3\xA9", "\xE2\x82\xAC", "\xF0\x9F\xA4\x96", "'", "\\");
  CAPTURE(id);
  CHECK(refusal(id) == "");
}

TEST_CASE("the limits of the UTF-8 ranges are accepted") {
  // First and last code point of each length, and the neighbours of the surrogates.
  const std::string id = GENERATE(as<std::string>{}, "\x20", "\x7E", "\xC2\xA0", "\xDF\xBF",
                                  "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80", "\xEF\xBF\xBF",
                                  "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF");
  CAPTURE(id);
  CHECK(refusal(id) == "");
}

TEST_CASE("an empty id is rejected by the name of its field") {
  CHECK(refusal("") == "child is empty");
}

TEST_CASE("an id has at most 255 bytes") {
  CHECK(refusal(std::string(255, 'a')) == "");
  const std::string message = refusal(std::string(256, 'a'));
  CHECK(contains(message, "child"));
  CHECK(contains(message, "256"));
  CHECK(contains(message, "255"));
  // A message must not repeat a megabyte of someone's garbage.
  CHECK(refusal(std::string(1'000'000, 'a')).size() < 200);
}

TEST_CASE("the limit counts bytes and not code points") {
  std::string id;
  for (int i = 0; i < 127; ++i) id += "\xC3\xA9";
  CHECK(refusal(id + "a") == "");
  CHECK(refusal(id + "\xC3\xA9") != "");
}

TEST_CASE("every control character is rejected wherever it is") {
  const int value = GENERATE(range(0x00, 0x20), range(0x7F, 0xA0));
  std::string control;
  if (value < 0x80) {
    control = static_cast<char>(value);
  } else {  // C1 controls take two bytes
    control = {static_cast<char>(0xC2), static_cast<char>(value)};
  }
  CAPTURE(value);
  CHECK(contains(refusal(control), "control character"));
  CHECK(contains(refusal("arm" + control), "control character"));
  CHECK(contains(refusal(control + "arm"), "control character"));
}

TEST_CASE("bytes that are not UTF-8 are rejected") {
  const std::string bad = GENERATE(
      as<std::string>{}, "\x80", "\xBF",                           // a continuation without a lead
      "\xC0\xAF", "\xC1\xBF", "\xE0\x80\xAF", "\xE0\x9F\xBF",      // overlong
      "\xF0\x80\x80\xAF", "\xF0\x8F\xBF\xBF",                      // overlong
      "\xED\xA0\x80", "\xED\xBF\xBF", "\xED\xA0\x80\xED\xB0\x80",  // surrogates, also in pairs
      "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFE", "\xFF",      // beyond U+10FFFF
      "\xC3", "\xE2\x82", "\xE2", "\xF0\x9F\xA4", "\xF0\x9F", "\xF0");  // truncated
  CAPTURE(bad);
  CHECK(contains(refusal(bad), "not valid UTF-8"));
  CHECK(contains(refusal("arm" + bad), "not valid UTF-8"));
  CHECK(contains(refusal(bad + "arm"), "not valid UTF-8"));
}

TEST_CASE("a rejection shows the bytes escaped and names the field") {
  CHECK(refusal("a\xFFz") == "child 'a\\xffz' is not valid UTF-8");
  CHECK(refusal("a\nz") == "child 'a\\x0az' holds a control character");
}

TEST_CASE("a new id does not look like another one") {
  const auto said = [](std::string_view id) {
    const auto ok = check_new_id(id, "id");
    return ok ? std::string() : ok.error().message;
  };
  for (const char* good : {"a", "left hand", "a  b", "\xC3\xA9tage 2", "\xE5\xB7\xA6", "a/b"}) {
    CHECK(said(good).empty());
  }
  CHECK(said("") == "id is empty");
  CHECK(said(" ") == "id ' ' begins with a space");
  CHECK(said(" a") == "id ' a' begins with a space");
  CHECK(said("a ") == "id 'a ' ends with a space");
  CHECK(said("-rf") == "id '-rf' begins with '-', like an option");
  CHECK(said("a-b-").empty());
  CHECK(contains(said("a\t"), "control character"));
  // No-break, narrow, ideographic and zero-width spaces, a joiner, marks of direction, a soft
  // hyphen, a filler, a variation selector, a tag.
  const std::string unseen = GENERATE(as<std::string>{}, "\xC2\xA0", "\xE2\x80\xAF", "\xE3\x80\x80",
                                      "\xE2\x80\x8B", "\xE2\x80\x8D", "\xE2\x80\xAE", "\xC2\xAD",
                                      "\xE3\x85\xA4", "\xEF\xB8\x8F", "\xF3\xA0\x80\x81");
  CAPTURE(unseen);
  for (const std::string& id : {unseen, "a" + unseen, unseen + "a", "a" + unseen + "b"}) {
    CHECK(contains(said(id), "cannot be seen or looks like a space"));
    // One that exists already is still an id, and is shown without doubt.
    CHECK(refusal(id).empty());
    CHECK(contains(quote(id), "\\x"));
    CHECK_FALSE(check_new_partition_name(id));
  }
  CHECK(said("a\xE2\x80\x8B") ==
        "id 'a\\xe2\\x80\\x8b' holds the character U+200B, which cannot be seen or looks like a "
        "space");
  CHECK(check_new_partition_name("left arm"));
  CHECK_FALSE(check_new_partition_name("arm "));
  CHECK_FALSE(check_new_partition_name("arm*"));
  CHECK(check_new_partition_name(std::string(200, 'a')));
  CHECK_FALSE(check_new_partition_name(std::string(201, 'a')));
}

TEST_CASE("a partition name is an id") {
  CHECK(check_partition_name("robot_1"));
  CHECK(check_partition_name("\xC3\xA9tage 2"));
  const auto empty = check_partition_name("");
  REQUIRE_FALSE(empty);
  CHECK(empty.error().code == Errc::kInvalidInput);
  CHECK(empty.error().message == "partition is empty");
  CHECK_FALSE(check_partition_name("a\tb"));
  CHECK_FALSE(check_partition_name("\xFF"));
  CHECK_FALSE(check_partition_name(std::string(256, 'a')));
}

TEST_CASE("a partition name has no character that DDS would expand") {
  const char meant = GENERATE('*', '?', '[', ']', ',');
  CAPTURE(meant);
  const auto refused = check_partition_name(std::string("robot") + meant + "1");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kInvalidInput);
  CHECK(contains(refused.error().message, std::string(1, meant)));
  CHECK(contains(refused.error().message, "partition"));
  // Frame ids may: they never become partitions.
  CHECK(check_id(std::string("robot") + meant + "1", "child"));
}

TEST_CASE("printable is the same as quote but without the quotes") {
  CHECK(printable("").empty());
  CHECK(printable("'arm' \xE2\x82\xAC\n\xFF") == "'arm' \xE2\x82\xAC\\x0a\\xff");
}

TEST_CASE("of a long text only the begin is quoted, and each id as a whole") {
  const std::string id(kMaxIdBytes, 'a');
  CHECK(quote(id) == "'" + id + "'");
  CHECK(quote(std::string(1'000'000, 'a')) == "'" + std::string(200, 'a') + "...' (1000000 bytes)");
  // No character is divided.
  std::string signs = "a";
  for (int i = 0; i < 200; ++i) signs += "\xC3\xA9";
  CHECK(quote(signs) == "'" + signs.substr(0, 199) + "...' (401 bytes)");
  CHECK(quote(std::string(400, '\x80')).size() < 1000);
}

TEST_CASE("quote keeps printable text and escapes the rest") {
  CHECK(quote("") == "''");
  CHECK(quote("arm_1") == "'arm_1'");
  CHECK(quote("\xE2\x82\xAC") == "'\xE2\x82\xAC'");
  CHECK(quote(std::string_view("a\0b", 3)) == "'a\\x00b'");
  CHECK(quote("\x1b[31m") == "'\\x1b[31m'");
  CHECK(quote("\x7F") == "'\\x7f'");
  CHECK(quote("\xC2\x85") == "'\\xc2\\x85'");
  CHECK(quote("\xE2\x82") == "'\\xe2\\x82'");
  CHECK(quote("\xED\xA0\x80") == "'\\xed\\xa0\\x80'");
}

TEST_CASE("quote always returns a printable line") {
  const int lead = GENERATE(range(0, 256));
  for (int second = 0; second < 256; ++second) {
    const std::string text = {static_cast<char>(lead), static_cast<char>(second)};
    if (const auto ok = check_id(quote(text), "text"); !ok) {
      CAPTURE(lead, second);
      FAIL(ok.error().message);
    }
  }
  SUCCEED();
}

}  // namespace
}  // namespace tfdude
