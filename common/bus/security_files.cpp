#include "common/bus/security_files.hpp"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>
#include <spdlog/fmt/chrono.h>
#include <tinyxml2.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <vector>

#include "common/config/config_error.hpp"

namespace sls::bus {
namespace {

using config::ConfigError;

template <class Object, void (*kFree)(Object*)>
struct Deleter {
  void operator()(Object* object) const { kFree(object); }
};
using Certificate = std::unique_ptr<X509, Deleter<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY, EVP_PKEY_free>>;
using Store = std::unique_ptr<X509_STORE, Deleter<X509_STORE, X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Deleter<X509_STORE_CTX, X509_STORE_CTX_free>>;
using Document = std::unique_ptr<PKCS7, Deleter<PKCS7, PKCS7_free>>;
using Stream = std::unique_ptr<BIO, Deleter<BIO, BIO_free_all>>;

constexpr const char* kAuthentication = "dds.sec.auth.builtin.PKI-DH.";
constexpr const char* kAccess = "dds.sec.access.builtin.Access-Permissions.";
constexpr std::uintmax_t kMostBytes = 1 << 20;

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw ConfigError(file + ": " + what);
}

/// The error message of openssl.
std::string find_openssl_error() {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return reason ? reason : "something else";
}

/// Value of every <property> below `element`, by name.
void collect_properties(const tinyxml2::XMLElement& element,
                        std::map<std::string, std::string>& properties) {
  const auto* name = element.FirstChildElement("name");
  const auto* value = element.FirstChildElement("value");
  if (std::string(element.Name()) == "property" && name && value && name->GetText() &&
      value->GetText())
    properties[name->GetText()] = value->GetText();
  for (auto* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    collect_properties(*child, properties);
}

/// The file that property `name` names as file://…
std::string find_file(const std::map<std::string, std::string>& properties,
                      const std::string& name) {
  const std::string scheme = "file://";
  const auto found = properties.find(name);
  if (found == properties.end()) fail(name, "expected a property of this name, got none");
  if (found->second.compare(0, scheme.size(), scheme) != 0)
    fail(name, "expected file://…, got '" + found->second + "'");
  return found->second.substr(scheme.size());
}

/// Called for an encrypted file: otherwise openssl asks the terminal, and the program waits.
int refuse_password(char*, int, int, void*) { return -1; }

Stream open(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    fail(file, "expected a file that ./sls keys made, got " +
                   (error ? error.message() : std::string("no such file")));
  if (!std::filesystem::is_regular_file(file, error))
    fail(file, "expected a file, got another kind");
  if (const auto size = std::filesystem::file_size(file, error); size > kMostBytes)
    fail(file, fmt::format("expected at most {} bytes, got {}", kMostBytes, size));
  Stream stream(BIO_new_file(file.c_str(), "r"));
  if (!stream) fail(file, "expected a readable file, got " + find_openssl_error());
  return stream;
}

Certificate read_certificate(const std::string& file) {
  const Stream stream = open(file);
  Certificate certificate(PEM_read_bio_X509(stream.get(), nullptr, refuse_password, nullptr));
  if (!certificate) fail(file, "expected a certificate (PEM), got " + find_openssl_error());
  return certificate;
}

std::string find_subject(X509& certificate) {
  const Stream text(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(text.get(), X509_get_subject_name(&certificate), 0, XN_FLAG_RFC2253);
  char* data = nullptr;
  const long size = BIO_get_mem_data(text.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

Store make_store(const std::string& authority_file) {
  open(authority_file);  // throws if it cannot be read
  Store store(X509_STORE_new());
  if (X509_STORE_load_file(store.get(), authority_file.c_str()) != 1)
    fail(authority_file, "expected certificates (PEM), got " + find_openssl_error());
  return store;
}

void check_certificate(const std::string& file, X509& certificate,
                       const std::string& authority_file) {
  const Store store = make_store(authority_file);
  const StoreContext context(X509_STORE_CTX_new());
  X509_STORE_CTX_init(context.get(), store.get(), &certificate, nullptr);
  if (X509_verify_cert(context.get()) != 1)
    fail(file,
         "expected a certificate that is valid now and signed by " + authority_file +
             ", got: " + X509_verify_cert_error_string(X509_STORE_CTX_get_error(context.get())));
}

void check_key(const std::string& file, X509& certificate, const std::string& certificate_file) {
  const Stream stream = open(file);
  const auto mode = static_cast<unsigned>(std::filesystem::status(file).permissions());
  if ((mode & 077) != 0)
    fail(file, fmt::format("expected mode 0600 or stricter, got {:04o}", mode & 07777));
  const Key key(PEM_read_bio_PrivateKey(stream.get(), nullptr, refuse_password, nullptr));
  if (!key)
    fail(file, "expected a private key (PEM) without a password, got " + find_openssl_error());
  if (X509_check_private_key(&certificate, key.get()) != 1)
    fail(file, "expected the private key of " + certificate_file + ", got another");
}

/// The text of a signed document.
std::string verify_document(const std::string& file, const std::string& authority_file) {
  const Stream stream = open(file);
  BIO* content = nullptr;
  const Document document(SMIME_read_PKCS7(stream.get(), &content));
  const Stream owned(content);
  if (!document) fail(file, "expected a signed document (S/MIME), got " + find_openssl_error());
  const Stream text(BIO_new(BIO_s_mem()));
  if (PKCS7_verify(document.get(), nullptr, make_store(authority_file).get(), content, text.get(),
                   PKCS7_TEXT) != 1)
    fail(file,
         "expected a document signed by " + authority_file + ", got: " + find_openssl_error());
  char* data = nullptr;
  const long size = BIO_get_mem_data(text.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

/// Reads a time as Fast DDS does: in the time zone of this machine. 0 if it is malformed.
std::time_t to_time(const tinyxml2::XMLElement* element) {
  std::tm time = {};
  std::istringstream stream(element && element->GetText() ? element->GetText() : "");
  stream >> std::get_time(&time, "%Y-%m-%dT%T");
  return stream.fail() ? 0 : std::mktime(&time);
}

/// A file and the time at which it ends.
struct Expiry {
  std::string file;
  std::time_t at;
};

Expiry find_expiry(const std::string& file, const X509& certificate) {
  std::tm time = {};
  ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &time);
  return {file, ::timegm(&time)};
}

/// The line about the file that ends first, if that is within 30 days.
std::string describe_first(const std::vector<Expiry>& all) {
  const std::time_t now = std::time(nullptr);
  const auto first = std::min_element(all.begin(), all.end(),
                                      [](const auto& a, const auto& b) { return a.at < b.at; });
  constexpr std::time_t kDay = 24 * 60 * 60;
  if (first->at - now > 30 * kDay) return "";
  return fmt::format(
      "{}: expected more than 30 days of validity, got {} (until {:%Y-%m-%d %H:%M} UTC): a running "
      "flight goes on after that, but no program joins one: renew it with ./sls keys",
      first->file, std::max<std::time_t>(first->at - now, 0) / kDay, fmt::gmtime(first->at));
}

/// The end of `grant`; 0 if it is for another subject. @throws ConfigError if it is not valid now.
std::time_t check_grant(const tinyxml2::XMLElement& grant, const std::string& subject,
                        const std::string& file) {
  const auto* name = grant.FirstChildElement("subject_name");
  if (!name || !name->GetText() || name->GetText() != subject) return 0;
  const auto* validity = grant.FirstChildElement("validity");
  if (!validity) fail(file, "expected <validity> in the grant for " + subject + ", got none");
  const auto* first = validity->FirstChildElement("not_before");
  const auto* last = validity->FirstChildElement("not_after");
  const std::time_t now = std::time(nullptr);
  if (now < to_time(first))
    fail(file, std::string("expected permissions that are valid now, got some from ") +
                   first->GetText() + " on");
  if (now > to_time(last))
    fail(file, std::string("expected permissions that are valid now, got some until ") +
                   (last && last->GetText() ? last->GetText() : "?"));
  return to_time(last);
}

Expiry check_permissions(const std::string& file, const std::string& authority_file,
                         const std::string& subject) {
  const std::string text = verify_document(file, authority_file);
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    fail(file, "expected well-formed XML, got " + std::string(document.ErrorName()));
  const auto* root = document.RootElement();
  const auto* permissions = root ? root->FirstChildElement("permissions") : nullptr;
  const auto* grant = permissions ? permissions->FirstChildElement("grant") : nullptr;
  for (; grant; grant = grant->NextSiblingElement("grant"))
    if (const std::time_t end = check_grant(*grant, subject, file); end != 0) return {file, end};
  fail(file, "expected permissions for " + subject + ", got none");
}

/// A signed document in plain text, and its signature.
std::string read_text(const std::filesystem::path& document) {
  std::ostringstream text;
  text << std::ifstream(document).rdbuf();
  return text.str();
}

}  // namespace

bool are_submessages_protected(const std::filesystem::path& governance) {
  return read_text(governance).find("<metadata_protection_kind>NONE<") == std::string::npos;
}

IdentityNames find_identity_names(const std::filesystem::path& certificate,
                                  const std::filesystem::path& authority) {
  return {find_subject(*read_certificate(certificate.string())),
          find_subject(*read_certificate(authority.string()))};
}

SecurityFiles check_security_files(const std::string& profiles) {
  tinyxml2::XMLDocument document;
  std::map<std::string, std::string> properties;
  if (document.Parse(profiles.data(), profiles.size()) != tinyxml2::XML_SUCCESS) return {};
  collect_properties(*document.RootElement(), properties);
  if (properties.count("dds.sec.auth.plugin") == 0) return {};

  ERR_clear_error();
  const auto file_of = [&](const std::string& name) { return find_file(properties, name); };
  const std::string certificate_file =
      file_of(std::string(kAuthentication) + "identity_certificate");
  const Certificate certificate = read_certificate(certificate_file);
  const std::string issuer = file_of(std::string(kAuthentication) + "identity_ca");
  check_certificate(certificate_file, *certificate, issuer);
  check_key(file_of(std::string(kAuthentication) + "private_key"), *certificate, certificate_file);

  const std::string authority = file_of(std::string(kAccess) + "permissions_ca");
  verify_document(file_of(std::string(kAccess) + "governance"), authority);
  return {true, describe_first({find_expiry(certificate_file, *certificate),
                                check_permissions(file_of(std::string(kAccess) + "permissions"),
                                                  authority, find_subject(*certificate)),
                                find_expiry(issuer, *read_certificate(issuer)),
                                find_expiry(authority, *read_certificate(authority))})};
}

}  // namespace sls::bus
