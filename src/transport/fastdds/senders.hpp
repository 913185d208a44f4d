#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "tfdude/base/result.hpp"

#include "transport/fastdds/access.hpp"
#include "transport/fastdds/acknowledgements.hpp"
#include "transport/fastdds/attention.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/farewells.hpp"
#include "transport/fastdds/peers.hpp"
#include "transport/fastdds/reply_paths.hpp"
#include "transport/fastdds/topics.hpp"
#include "transport/fastdds/writer_table.hpp"
#include "transport/port.hpp"

namespace tfdude::fastdds {

/// Sends to the owners of partitions: requests, changes and streams. A topic has a writer for each
/// owner, in the DDS partition of its name, so messages reach only those concerned.
/// @par Thread safety  All functions are thread-safe.
class Senders {
 public:
  /// What it uses of the transport; all of it outlives this.
  struct Parts {
    Context context;
    Topics& topics;
    Peers& peers;
    Attention& attention;
    const Access& access;
    const ReplyPaths& reply_paths;
    Acknowledgements& acknowledgements;
    Farewells& farewells;
    std::uint32_t domain;  // for messages
  };

  explicit Senders(const Parts& parts) : parts_(parts) {}

  /// Starts to connect to a partition.
  /// @param changes  also for requests that change something
  void prepare(const std::string& partition, bool changes);
  // As those of Transport.
  [[nodiscard]] Result<void> send(const std::string& partition, const Request& request,
                                  Deadline deadline);
  [[nodiscard]] Result<void> send(const std::string& partition, const Update& update,
                                  Deadline deadline);
  [[nodiscard]] Result<void> send(const std::string& partition, const JointUpdate& update,
                                  Deadline deadline);
  [[nodiscard]] std::unique_ptr<Channel<Update>> update_channel(const std::string& partition);
  [[nodiscard]] std::unique_ptr<Channel<JointUpdate>> joint_channel(const std::string& partition);
  [[nodiscard]] Result<void> flush(Deadline deadline);

  /// The partitions to which something was sent recently.
  [[nodiscard]] std::set<std::string> used_owners() const;
  /// Those of them that can be asked for a sign of life.
  [[nodiscard]] std::set<std::string> askable(const std::set<std::string>& partitions);
  /// Asks for a sign of life.
  void probe(const std::string& partition);

 private:
  /// A table whose writers are in the DDS partitions of their names.
  [[nodiscard]] WriterTable<std::string> writers_of(edds::Topic* topic, const char* profile) const;
  [[nodiscard]] Result<void> send(Writer& writer, const std::string& partition, void* sample,
                                  Deadline deadline);
  [[nodiscard]] Result<void> await_match(Writer& writer, const std::string& partition,
                                         Deadline deadline);
  [[nodiscard]] Result<void> flush(Writer& stream, const std::string& partition, Deadline deadline);
  [[nodiscard]] bool await_reply_path(Writer& writer, const std::string& partition,
                                      Deadline deadline);
  [[nodiscard]] Error undiscovered(const std::string& partition) const;
  template <class Message, class Sample>
  std::unique_ptr<Channel<Message>> channel(WriterTable<std::string>& writers,
                                            const std::string& partition);

  const Parts parts_;
  WriterTable<std::string> requests_{writers_of(parts_.topics.request, "call_writer")};
  WriterTable<std::string> changes_{writers_of(parts_.topics.change, "call_writer")};
  WriterTable<std::string> updates_{writers_of(parts_.topics.update, "update_writer")};
  WriterTable<std::string> joints_{writers_of(parts_.topics.joint, "update_writer")};
};

}  // namespace tfdude::fastdds
