#pragma once

#include <string>
#include <utility>

#include "tfdude/base/result.hpp"

#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// QoS by the names in profiles/tfdude.xml, without their prefix ("participant", "call_writer"...).
/// They come from the file that a participant named, and profiles that it lacks from the built-in
/// ones. Other participants of the process have their own.
class Profiles {
 public:
  /// @param file  empty: only the built-in profiles; kLocalProfile: those restricted to this
  ///   computer
  /// @return kConfig naming the file.
  [[nodiscard]] static Result<Profiles> load(const std::string& file);

  [[nodiscard]] edds::DomainParticipantQos participant() const;
  [[nodiscard]] edds::DataWriterQos writer(edds::Publisher& publisher,
                                           const std::string& name) const;
  [[nodiscard]] edds::DataReaderQos reader(edds::Subscriber& subscriber,
                                           const std::string& name) const;

 private:
  explicit Profiles(std::string own) : own_(std::move(own)) {}
  template <class Read>
  void fill(const std::string& name, Read read) const;

  std::string own_;  // the ending of the names of the file's profiles; empty: no file
};

}  // namespace tfdude::fastdds
