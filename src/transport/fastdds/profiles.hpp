#pragma once

#include <string>
#include <utility>

#include "tfdude/base/result.hpp"

#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// QoS by the names of profiles/tfdude.xml, without their prefix ("participant", "call_writer"...): of the file that one
/// participant named, and where that lacks one, of the built-in profiles. Other participants of the process have their
/// own.
class Profiles {
 public:
  /// @param file  empty: the built-in profiles alone; kLocalProfile: those confined to this computer
  /// @return kConfig naming the file.
  [[nodiscard]] static Result<Profiles> load(const std::string& file);

  [[nodiscard]] edds::DomainParticipantQos participant() const;
  [[nodiscard]] edds::DataWriterQos writer(edds::Publisher& publisher,
                                           const std::string& name) const;
  [[nodiscard]] edds::DataReaderQos reader(edds::Subscriber& subscriber,
                                           const std::string& name) const;

 private:
  Profiles(std::string builtin, std::string own)
      : builtin_(std::move(builtin)), own_(std::move(own)) {}
  template <class Read>
  void fill(const std::string& name, Read read) const;

  // What the names in the process end with.
  std::string builtin_;
  std::string own_;
};

}  // namespace tfdude::fastdds
