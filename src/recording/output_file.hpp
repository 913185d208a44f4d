#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"

namespace tfdude::recording {

/// A new file that only grows. If bytes cannot be written, all of that call are removed again.
class OutputFile {
 public:
  /// @return kAlreadyExists; kInvalidInput: it cannot be created
  [[nodiscard]] static Result<std::unique_ptr<OutputFile>> create(const std::string& name);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// @return kInvalidInput, naming the file and the reason
  [[nodiscard]] Result<void> write(std::string_view bytes);

 private:
  OutputFile(std::string name, int fd) : name_(std::move(name)), fd_(fd) {}
  std::string name_;
  int fd_;
  std::uint64_t size_ = 0;
};

}  // namespace tfdude::recording
