#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/belief.hpp"

// A source that dynamic edges name is one error an instant. What an observation leaves of it on
// other edges is the error of that instant only, under a name of its own. How this is correlated
// with the source at other instants, and on edges that were not observed, is not known. Neither is
// it how errors at one instant are that come from samples with different stamps.
namespace tfdude {

/// Whether the library made the name: an observation has left the error, or it comes from two
/// samples. Nobody can declare such a source.
[[nodiscard]] bool is_made(std::string_view name);

/// The name of a source's error at an instant, the same for all observations of that instant.
[[nodiscard]] std::string instant_source(std::string_view source, Time stamp);

/// The name for the errors of a source at several instants, of which an observation makes one.
/// @param observation  the name of the observation's source
[[nodiscard]] std::string merged_source(std::string_view observation, std::string_view source);

/// Another name for the error of one instant, which says that it may be merged with others.
[[nodiscard]] std::string as_merged(std::string_view of_one_instant);

/// The name of a source's error in what is interpolated, or extrapolated, from these two samples.
[[nodiscard]] std::string source_between(std::string_view source, Time before, Time after);

/// The name for what a new sample of this instant has of that error, once it is stored.
[[nodiscard]] std::string stored_between(std::string_view source_between, Time at);

/// Gives errors that names.
void store_between(Time at, std::vector<CommonError>& common_errors);

/// Whether it is a name of these two kinds.
[[nodiscard]] bool is_between_samples(std::string_view name);

/// Whether it is one of those that are not stored: the values of an edge tell it, and no
/// observation has left it.
[[nodiscard]] bool is_of_two_samples(std::string_view name);

/// What a user calls the source: as it was said, if the error comes from two samples.
[[nodiscard]] std::string_view shown_source(std::string_view name);

/// The instant of such a stored error, or of one instant, as a text; empty: the name has none.
[[nodiscard]] std::string_view instant_in(std::string_view name);

/// The source of whose error at some instants this is; empty: of none. Long names are
/// shortened.
[[nodiscard]] std::string_view said_source(std::string_view name);

/// Whether it is the error of one instant, on its own.
[[nodiscard]] bool is_of_one_instant(std::string_view name);

/// Whether the name is that of the source itself, which said_source() may have shortened.
[[nodiscard]] bool is_source_itself(std::string_view name, std::string_view said);

/// Whether any of them is the error of a source at some instants.
[[nodiscard]] bool has_instants(const std::vector<CommonError>& common_errors);

/// At an instant, its error of a source is the source's. @return whether there was one
bool join_instant(std::vector<CommonError>& common_errors, Time stamp);

/// The common errors of an edge, or of some.
struct ErrorsOfEdge {
  std::vector<CommonError>* errors;  ///< not null
  bool lasts;                        ///< it is static, or drifts
};

/// Gives the errors between samples the names of their sources again that an edge names which
/// lasts: such a source has one error for all time.
void join_lasting(const std::vector<ErrorsOfEdge>& edges);

/// By what the square of each error counts in allow_any_relation(); empty: each of them once.
[[nodiscard]] std::vector<double> relation_weights(const std::vector<CommonError>& common_errors);

/// Makes errors of a source, of the same source at some instants, and of each two samples, as large
/// as suffices for any correlation of these. @return whether there were any
bool allow_any_relation(std::vector<CommonError>& common_errors);

/// A covariance with the name of the source that it comes from.
using OfSource = std::pair<std::string, Covariance>;

/// The sum, by the same rule. @param bounded  set to true if there were any
[[nodiscard]] Covariance sum_of_sources(const std::vector<OfSource>& parts, bool& bounded);

}  // namespace tfdude
