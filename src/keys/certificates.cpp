#include "keys/certificates.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include "tfdude/base/id.hpp"

namespace tfdude::keys {
namespace {

using Number = Owned<BIGNUM, BN_free>;
using AsnNumber = Owned<ASN1_INTEGER, ASN1_INTEGER_free>;
using Store = Owned<X509_STORE, X509_STORE_free>;
using StoreContext = Owned<X509_STORE_CTX, X509_STORE_CTX_free>;
using Extension = Owned<X509_EXTENSION, X509_EXTENSION_free>;

// OpenSSL's function is a macro.
void free_stack(STACK_OF(X509) * stack) { sk_X509_free(stack); }

struct ExtensionText {
  int nid;
  const char* value;
};

// Fast DDS 3.1 requires a strict certificate of an authority. The authority also signs documents.
constexpr std::array<ExtensionText, 3> kOfAuthority{{
    {NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
    {NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature"},
    {NID_subject_key_identifier, "hash"},
}};

// Fast DDS 2.9 accepts permissions that are signed with any certificate of the authority, if that
// may sign S/MIME. Without the extended usage each identity could sign permissions for itself.
constexpr std::array<ExtensionText, 5> kOfIdentity{{
    {NID_basic_constraints, "critical,CA:FALSE"},
    {NID_key_usage, "critical,digitalSignature"},
    {NID_ext_key_usage, "critical,clientAuth,serverAuth"},
    {NID_subject_key_identifier, "hash"},
    {NID_authority_key_identifier, "keyid:always"},
}};

constexpr int kSerialBits = 127;
constexpr std::size_t kAuthorityBytes = 4;

std::string hexadecimal(const Number& number) {
  char* text = number == nullptr ? nullptr : BN_bn2hex(number.get());
  std::string copy = text == nullptr ? "" : text;
  OPENSSL_free(text);
  return copy;
}

bool set_name(X509_NAME* subject, const std::string& name) {
  const std::vector<unsigned char> bytes(name.begin(), name.end());
  return X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, bytes.data(),
                                    static_cast<int>(bytes.size()), -1, 0) == 1;
}

template <class Extensions>
bool add_extensions(X509* certificate, X509* issuer, const Extensions& extensions) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  return std::all_of(extensions.begin(), extensions.end(), [&](const ExtensionText& text) {
    const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, text.nid, text.value));
    return extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1;
  });
}

// A certificate for a new key, but for its extensions and signature.
Result<Pair> unsigned_pair(const std::string& name, const Validity& validity) {
  const Number serial(BN_new());
  Pair pair{Key(EVP_EC_gen("P-256")), Certificate(X509_new())};
  X509* const made = pair.certificate.get();
  const AsnTime from = asn_of(validity.from);
  const AsnTime until = asn_of(validity.until);
  if (pair.key == nullptr || made == nullptr || serial == nullptr || from == nullptr ||
      until == nullptr ||
      BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) != 1 ||
      X509_set_version(made, X509_VERSION_3) != 1 ||
      BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(made)) == nullptr ||
      X509_set1_notBefore(made, from.get()) != 1 || X509_set1_notAfter(made, until.get()) != 1 ||
      X509_set_pubkey(made, pair.key.get()) != 1 || !set_name(X509_get_subject_name(made), name)) {
    return openssl_error("no certificate can be made for " + quote(name));
  }
  return pair;
}

tl::unexpected<Error> not_signed(const std::string& name) {
  return openssl_error("the certificate of " + quote(name) + " cannot be signed");
}

bool add_serial(X509_CRL* list, const std::string& serial, ASN1_TIME* now) {
  BIGNUM* parsed = nullptr;
  const bool is_number = BN_hex2bn(&parsed, serial.c_str()) == static_cast<int>(serial.size());
  const Number number(parsed);
  const AsnNumber asn(is_number ? BN_to_ASN1_INTEGER(number.get(), nullptr) : nullptr);
  Owned<X509_REVOKED, X509_REVOKED_free> entry(X509_REVOKED_new());
  const bool added = asn != nullptr && entry != nullptr &&
                     X509_REVOKED_set_serialNumber(entry.get(), asn.get()) == 1 &&
                     X509_REVOKED_set_revocationDate(entry.get(), now) == 1 &&
                     X509_CRL_add0_revoked(list, entry.get()) == 1;
  if (added) (void)entry.release();  // the list owns it
  return added;
}

}  // namespace

Result<Pair> make_authority(const Validity& validity) {
  const auto digits = random_digits(kAuthorityBytes);
  if (!digits) return tl::unexpected(digits.error());
  const std::string name = "tf-dude authority " + *digits;
  auto pair = unsigned_pair(name, validity);
  if (!pair) return pair;
  X509* const made = pair->certificate.get();
  if (X509_set_issuer_name(made, X509_get_subject_name(made)) != 1 ||
      !add_extensions(made, made, kOfAuthority) ||
      X509_sign(made, pair->key.get(), EVP_sha256()) == 0) {
    return not_signed(name);
  }
  return pair;
}

Result<Pair> issue(const Pair& authority, const std::string& name, const Validity& validity) {
  auto pair = unsigned_pair(name, validity);
  if (!pair) return pair;
  X509* const made = pair->certificate.get();
  X509* const issuer = authority.certificate.get();
  if (X509_set_issuer_name(made, X509_get_subject_name(issuer)) != 1 ||
      !add_extensions(made, issuer, kOfIdentity) ||
      X509_sign(made, authority.key.get(), EVP_sha256()) == 0) {
    return not_signed(name);
  }
  return pair;
}

Result<RevokedList> make_revoked(const Pair& authority, const std::vector<std::string>& serials,
                                 Time now) {
  RevokedList list(X509_CRL_new());
  const AsnTime date = asn_of(now);
  X509* const issuer = authority.certificate.get();
  bool made = list != nullptr && date != nullptr &&
              X509_CRL_set_version(list.get(), X509_CRL_VERSION_2) == 1 &&
              X509_CRL_set_issuer_name(list.get(), X509_get_subject_name(issuer)) == 1 &&
              X509_CRL_set1_lastUpdate(list.get(), date.get()) == 1 &&
              X509_CRL_set1_nextUpdate(list.get(), X509_get0_notAfter(issuer)) == 1;
  for (const std::string& serial : serials) {
    made = made && add_serial(list.get(), serial, date.get());
  }
  made = made && X509_CRL_sort(list.get()) == 1 &&
         X509_CRL_sign(list.get(), authority.key.get(), EVP_sha256()) != 0;
  if (!made) return openssl_error("the list of revoked certificates cannot be made");
  return list;
}

std::string subject_of(const std::string& name) { return "CN=" + name; }

std::string name_of(const Certificate& certificate) {
  const X509_NAME* const subject = X509_get_subject_name(certificate.get());
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  const X509_NAME_ENTRY* const entry = at < 0 ? nullptr : X509_NAME_get_entry(subject, at);
  unsigned char* text = nullptr;
  const int size =
      entry == nullptr ? -1 : ASN1_STRING_to_UTF8(&text, X509_NAME_ENTRY_get_data(entry));
  std::string name(text, text + std::max(size, 0));
  OPENSSL_free(text);
  return name;
}

Result<std::string> random_digits(std::size_t bytes) {
  std::vector<unsigned char> random(bytes);
  if (RAND_bytes(random.data(), static_cast<int>(bytes)) != 1)
    return openssl_error("no random number");
  std::string digits;
  for (const unsigned char byte : random) {
    digits += "0123456789abcdef"[byte >> 4U];
    digits += "0123456789abcdef"[byte & 0xFU];
  }
  return digits;
}

std::string serial_of(const Certificate& certificate) {
  return hexadecimal(
      Number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate.get()), nullptr)));
}

Result<Validity> validity_of(const Certificate& certificate) {
  const auto from = time_of(X509_get0_notBefore(certificate.get()));
  if (!from) return tl::unexpected(from.error());
  const auto until = time_of(X509_get0_notAfter(certificate.get()));
  if (!until) return tl::unexpected(until.error());
  return Validity{*from, *until};
}

Result<void> verify(const Certificate& authority, const RevokedList& revoked,
                    const Certificate& certificate, Time now) {
  const Store store(X509_STORE_new());
  const StoreContext context(X509_STORE_CTX_new());
  if (store == nullptr || context == nullptr ||
      X509_STORE_add_cert(store.get(), authority.get()) != 1 ||
      X509_STORE_add_crl(store.get(), revoked.get()) != 1 ||
      X509_STORE_CTX_init(context.get(), store.get(), certificate.get(), nullptr) != 1) {
    return openssl_error("the certificate cannot be verified");
  }
  X509_STORE_CTX_set_flags(context.get(), X509_V_FLAG_CRL_CHECK | X509_V_FLAG_X509_STRICT |
                                              X509_V_FLAG_CHECK_SS_SIGNATURE);
  X509_STORE_CTX_set_time(context.get(), 0, std::chrono::system_clock::to_time_t(now));
  if (X509_verify_cert(context.get()) == 1) return {};
  const bool own = X509_STORE_CTX_get_error_depth(context.get()) == 0;
  const char* reason = X509_verify_cert_error_string(X509_STORE_CTX_get_error(context.get()));
  return fail(Errc::kConfig, std::string(own ? "" : "the certificate of the authority: ") + reason);
}

Result<std::string> sign_document(const Pair& authority, std::string_view text) {
  // What `openssl smime -sign -text -nosmimecap` makes.
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_NOSMIMECAP;
  const Bio in = bio_of(text);
  const Bio out = sink();
  const Signed made(in == nullptr ? nullptr
                                  : PKCS7_sign(authority.certificate.get(), authority.key.get(),
                                               nullptr, in.get(), kFlags));
  if (made == nullptr || out == nullptr || BIO_reset(in.get()) != 1 ||
      SMIME_write_PKCS7(out.get(), made.get(), in.get(), kFlags) != 1) {
    return openssl_error("a document cannot be signed");
  }
  return std::string(text_of(out));
}

Result<std::string> verify_document(const Certificate& authority, std::string_view document) {
  const Bio in = bio_of(document);
  BIO* content = nullptr;
  const Signed made(in == nullptr ? nullptr : SMIME_read_PKCS7(in.get(), &content));
  const Bio content_owned(content);
  if (made == nullptr) return openssl_error("is no signed document");
  // Only the authority's certificate counts as that of the signer, as in Fast DDS 3.1.
  const Owned<STACK_OF(X509), free_stack> signers(sk_X509_new_null());
  const Bio out = sink();
  if (signers == nullptr || out == nullptr || sk_X509_push(signers.get(), authority.get()) <= 0 ||
      PKCS7_verify(made.get(), signers.get(), nullptr, content, out.get(),
                   PKCS7_TEXT | PKCS7_NOVERIFY | PKCS7_NOINTERN) != 1) {
    return openssl_error("is not what the authority signed");
  }
  std::string text(text_of(out));
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
  return text;
}

}  // namespace tfdude::keys
