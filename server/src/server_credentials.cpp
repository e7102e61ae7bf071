#include "server_credentials.h"

#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include "files.h"

namespace amhex::server {
namespace {

constexpr unsigned kReloadSeconds = 5;

template <class T, void (*Free)(T*)>
struct Deleter {
  void operator()(T* object) const { Free(object); }
};
using UniqueBio = std::unique_ptr<BIO, Deleter<BIO, BIO_free_all>>;
using UniqueKey = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY, EVP_PKEY_free>>;
using UniqueCertificate = std::unique_ptr<X509, Deleter<X509, X509_free>>;

absl::Status Refuse(const std::string& problem) { return absl::InvalidArgumentError(problem); }

UniqueBio Open(const std::string& path) {
  const auto text = ReadWholeFile(path);
  if (!text.ok()) return nullptr;
  UniqueBio bio(BIO_new(BIO_s_mem()));
  if (BIO_write(bio.get(), text->data(), static_cast<int>(text->size())) < 0) return nullptr;
  return bio;
}

UniqueCertificate ReadCertificate(const std::string& path) {
  const UniqueBio bio = Open(path);
  if (!bio) return nullptr;
  return UniqueCertificate(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
}

UniqueKey ReadKey(const std::string& path) {
  const UniqueBio bio = Open(path);
  if (!bio) return nullptr;
  // An empty passphrase instead of a prompt on the terminal.
  return UniqueKey(PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, const_cast<char*>("")));
}

}  // namespace

absl::Status CheckTlsFiles(const TlsFiles& files) {
  if (!files.wanted()) return absl::OkStatus();
  if (files.certificate.empty() || files.key.empty()) {
    return Refuse("--tls-cert and --tls-key are needed together, also for --tls-client-ca");
  }
  const UniqueCertificate certificate = ReadCertificate(files.certificate);
  if (!certificate) return Refuse("--tls-cert " + files.certificate + " is no PEM certificate");
  const UniqueKey key = ReadKey(files.key);
  if (!key) return Refuse("--tls-key " + files.key + " is no PEM key without passphrase");
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    return Refuse("--tls-key does not belong to --tls-cert");
  }
  if (!files.client_ca.empty() && !ReadCertificate(files.client_ca)) {
    return Refuse("--tls-client-ca " + files.client_ca + " is no PEM certificate");
  }
  return absl::OkStatus();
}

absl::Status CheckPeerCa(const std::string& path) {
  if (path.empty() || ReadCertificate(path)) return absl::OkStatus();
  return Refuse("--peer-ca " + path + " is no PEM certificate");
}

std::shared_ptr<grpc::ServerCredentials> MakeServerCredentials(const TlsFiles& files) {
  if (!files.wanted()) return grpc::InsecureServerCredentials();
  namespace tls = grpc::experimental;
  const auto provider = std::make_shared<tls::FileWatcherCertificateProvider>(
      files.key, files.certificate, files.client_ca, kReloadSeconds);
  tls::TlsServerCredentialsOptions options(provider);
  options.watch_identity_key_cert_pairs();
  if (!files.client_ca.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return tls::TlsServerCredentials(options);
}

std::shared_ptr<grpc::ChannelCredentials> MakePeerCredentials(const std::string& peer_ca,
                                                              const TlsFiles& own) {
  if (peer_ca.empty()) return grpc::InsecureChannelCredentials();
  namespace tls = grpc::experimental;
  const bool shows_own = !own.client_ca.empty();
  tls::TlsChannelCredentialsOptions options;
  options.set_certificate_provider(
      shows_own ? std::make_shared<tls::FileWatcherCertificateProvider>(own.key, own.certificate,
                                                                        peer_ca, kReloadSeconds)
                : std::make_shared<tls::FileWatcherCertificateProvider>(peer_ca, kReloadSeconds));
  options.watch_root_certs();
  if (shows_own) options.watch_identity_key_cert_pairs();
  return tls::TlsCredentials(options);
}

}  // namespace amhex::server
