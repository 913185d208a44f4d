#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server.hpp"

// The rules of whom the site serves, and what, without a network.
namespace tfdude::web {

struct Access {
  bool loopback = true;  ///< the server listens on this computer only
  std::string token;     ///< that clients must know; empty: none
  /// Origins of other pages that may connect, such as "https://app.foxglove.dev".
  std::vector<std::string> origins;
};

/// Whether a request may be answered. @return null, or why not
[[nodiscard]] std::unique_ptr<Reply> reject(const Access& access, const Request& request);

/// The value of a parameter in a query; empty if it is not there.
[[nodiscard]] std::string parameter(const std::string& query, const std::string& name);

/// The first of the offered subprotocols that is known; empty: none.
[[nodiscard]] std::string choose_protocol(const std::string& offered,
                                          const std::vector<std::string>& known);

/// The files that are served, read at the start.
class Files {
 public:
  /// Adds all files of a folder whose type is known.
  /// @return kConfig: the folder cannot be read, or has no such file
  [[nodiscard]] Result<void> add_folder(const std::string& folder, const std::string& path);
  /// @return kConfig: the file cannot be read
  [[nodiscard]] Result<void> add_file(const std::string& file, const std::string& path);
  void add(const std::string& path, const std::string& type, std::string content);

  [[nodiscard]] Reply get(const std::string& path) const;

 private:
  std::map<std::string, Reply> files_;
};

}  // namespace tfdude::web
