// Writes seeds: make_seeds FOLDER. One file for each message of tests/support/samples.hpp, and choices for the
// harness of partitions; those of configurations are written by hand.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "support/samples.hpp"

namespace tfdude::fuzz {
namespace {

using testing::Bytes;
using testing::Random;

void write(const std::filesystem::path& folder, const std::string& name, const Bytes& bytes) {
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / name, std::ios::binary);
  for (const std::uint8_t byte : bytes) file.put(static_cast<char>(byte));
}

// "reply 3" and "update of 2" as folder and file.
void write_samples(const std::filesystem::path& folder) {
  Random random(0x5eed);
  for (const testing::WireKind& kind : testing::wire_kinds(random)) {
    const std::string topic = kind.name.substr(0, kind.name.find(' '));
    const std::string rest = kind.name.substr(kind.name.rfind(' ') + 1);
    write(folder / topic, rest, kind.valid);
  }
}

void write_choices(const std::filesystem::path& folder) {
  Random random(0xc401ce);
  for (const std::size_t size : {16U, 64U, 256U, 1024U}) {
    Bytes bytes(size);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
    write(folder / "partition", std::to_string(size), bytes);
  }
}

}  // namespace
}  // namespace tfdude::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_seeds FOLDER\n", stderr);
    return 2;
  }
  tfdude::fuzz::write_samples(argv[1]);
  tfdude::fuzz::write_choices(argv[1]);
}
