#include "tfdude/client/state_repair.hpp"

#include "store/sqlite_store.hpp"

namespace tfdude {

Result<std::vector<std::string>> drop_damaged_state(const std::string& partition,
                                                    const NodeOptions& options) {
  if (options.state.empty()) return std::vector<std::string>();
  return drop_wrong_rows(state_file(options.state, options.domain, partition), partition);
}

}  // namespace tfdude
