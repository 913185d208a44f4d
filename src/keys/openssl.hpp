#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

// OpenSSL's objects with a lifetime.
namespace tfdude::keys {

template <auto Free>
struct FreedBy {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
template <class T, auto Free>
using Owned = std::unique_ptr<T, FreedBy<Free>>;

using Bio = Owned<BIO, BIO_free_all>;
using Key = Owned<EVP_PKEY, EVP_PKEY_free>;
using Certificate = Owned<X509, X509_free>;
using RevokedList = Owned<X509_CRL, X509_CRL_free>;
using Signed = Owned<PKCS7, PKCS7_free>;
using AsnTime = Owned<ASN1_TIME, ASN1_TIME_free>;

/// What OpenSSL says about its last failure, which is forgotten by that.
[[nodiscard]] std::string openssl_reason();

/// kConfig with this text and OpenSSL's reason.
[[nodiscard]] tl::unexpected<Error> openssl_error(const std::string& what);

/// A source that reads a text, which must outlive it.
[[nodiscard]] Bio bio_of(std::string_view text);
/// A sink in memory that is overwritten when it is freed.
[[nodiscard]] Bio sink();
/// What was written to a sink, valid as long as it.
[[nodiscard]] std::string_view text_of(const Bio& sink);

/// To the second.
[[nodiscard]] AsnTime asn_of(Time time);
[[nodiscard]] Result<Time> time_of(const ASN1_TIME* time);

// In PEM. Reading fails with kConfig.
[[nodiscard]] Result<Key> read_key(std::string_view pem);
[[nodiscard]] Result<Certificate> read_certificate(std::string_view pem);
[[nodiscard]] Result<RevokedList> read_revoked(std::string_view pem);
/// @return a sink, so that the key is overwritten after use
[[nodiscard]] Result<Bio> pem_of(const Key& key);
[[nodiscard]] Result<std::string> pem_of(const Certificate& certificate);
[[nodiscard]] Result<std::string> pem_of(const RevokedList& revoked);

}  // namespace tfdude::keys
