#include "keys/openssl.hpp"

#include <array>
#include <ctime>
#include <utility>

#include <openssl/err.h>
#include <openssl/pem.h>

namespace tfdude::keys {
namespace {

template <class Object, class Read>
Result<Object> read_pem(std::string_view pem, const char* what, Read read) {
  const Bio bio = bio_of(pem);
  Object object(bio == nullptr ? nullptr : read(bio.get(), nullptr, nullptr, nullptr));
  if (object == nullptr) return openssl_error(std::string("is no ") + what);
  return object;
}

template <class Object, class Write>
Result<std::string> to_pem(const Object& object, Write write) {
  const Bio bio = sink();
  if (bio == nullptr || write(bio.get(), object.get()) != 1)
    return openssl_error("cannot be encoded");
  return std::string(text_of(bio));
}

// Without it, OpenSSL would ask for the password of an encrypted key on the terminal.
int no_password(char*, int, int, void*) { return -1; }

}  // namespace

std::string openssl_reason() {
  std::array<char, 256> text{};
  ERR_error_string_n(ERR_peek_last_error(), text.data(), text.size());
  ERR_clear_error();
  return text.data();
}

tl::unexpected<Error> openssl_error(const std::string& what) {
  return fail(Errc::kConfig, what + " (OpenSSL: " + openssl_reason() + ")");
}

Bio bio_of(std::string_view text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

Bio sink() { return Bio(BIO_new(BIO_s_secmem())); }

std::string_view text_of(const Bio& sink) {
  char* text = nullptr;
  const long size = BIO_get_mem_data(sink.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

AsnTime asn_of(Time time) {
  return AsnTime(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(time)));
}

Result<Time> time_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return openssl_error("has an invalid time");
  return std::chrono::system_clock::from_time_t(timegm(&parts));
}

Result<Key> read_key(std::string_view pem) {
  const Bio bio = bio_of(pem);
  Key key(bio == nullptr ? nullptr
                         : PEM_read_bio_PrivateKey(bio.get(), nullptr, no_password, nullptr));
  if (key == nullptr) return openssl_error("is no private key without a password");
  return key;
}

Result<Certificate> read_certificate(std::string_view pem) {
  return read_pem<Certificate>(pem, "certificate", PEM_read_bio_X509);
}

Result<RevokedList> read_revoked(std::string_view pem) {
  return read_pem<RevokedList>(pem, "list of revoked certificates", PEM_read_bio_X509_CRL);
}

Result<Bio> pem_of(const Key& key) {
  Bio bio = sink();
  if (bio == nullptr || PEM_write_bio_PKCS8PrivateKey(bio.get(), key.get(), nullptr, nullptr, 0,
                                                      nullptr, nullptr) != 1) {
    return openssl_error("the private key cannot be encoded");
  }
  return bio;
}

Result<std::string> pem_of(const Certificate& certificate) {
  return to_pem(certificate, PEM_write_bio_X509);
}

Result<std::string> pem_of(const RevokedList& revoked) {
  return to_pem(revoked, PEM_write_bio_X509_CRL);
}

}  // namespace tfdude::keys
