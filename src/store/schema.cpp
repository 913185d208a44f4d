#include "store/schema.hpp"

#include <array>

namespace tfdude {
namespace {

constexpr std::array<const char*, kFormat> kSchemas{R"(
  CREATE TABLE about(partition TEXT NOT NULL, epoch INTEGER NOT NULL);
  CREATE TABLE frames(id TEXT PRIMARY KEY, parent TEXT NOT NULL, x_pc BLOB NOT NULL,
                      since INTEGER NOT NULL) WITHOUT ROWID;
  CREATE TABLE notes(id TEXT PRIMARY KEY, since INTEGER NOT NULL, kind INTEGER NOT NULL,
                     rival TEXT NOT NULL) WITHOUT ROWID;
  CREATE TABLE configured(id TEXT PRIMARY KEY, parent TEXT NOT NULL, x_pc BLOB NOT NULL)
                     WITHOUT ROWID;
)",
                                                    R"(
  CREATE TABLE joints(name TEXT PRIMARY KEY, position REAL NOT NULL, variance REAL NOT NULL)
                     WITHOUT ROWID;
)",
                                                    R"(
  CREATE TABLE ties(id TEXT PRIMARY KEY, said BLOB NOT NULL, observed BLOB NOT NULL)
                     WITHOUT ROWID;
  CREATE TABLE configured_ties(id TEXT PRIMARY KEY, said BLOB NOT NULL) WITHOUT ROWID;
  CREATE TABLE joint_types(name TEXT PRIMARY KEY, type INTEGER NOT NULL) WITHOUT ROWID;
  CREATE TABLE absent(partition TEXT PRIMARY KEY, since INTEGER NOT NULL, kind INTEGER NOT NULL,
                      incarnation INTEGER NOT NULL) WITHOUT ROWID;
)", "",
                                                    R"(
  CREATE TABLE samples(id TEXT PRIMARY KEY, stamp INTEGER NOT NULL) WITHOUT ROWID;
)",
                                                    R"(
  CREATE TABLE sums(name TEXT PRIMARY KEY, sum INTEGER NOT NULL) WITHOUT ROWID;
)",
                                                    R"(
  CREATE TABLE configured_joints(id TEXT PRIMARY KEY, name TEXT NOT NULL, follows TEXT NOT NULL)
                     WITHOUT ROWID;
)"};

}  // namespace

std::string schema_of(std::int64_t format, std::int64_t older) {
  std::string schema;
  for (std::int64_t i = older; i < format; ++i) schema += kSchemas.at(static_cast<std::size_t>(i));
  return schema;
}

}  // namespace tfdude
