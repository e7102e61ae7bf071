// Certificates for tests, made afresh: an authority, and what it signs.
#pragma once

#include <memory>
#include <string>

struct evp_pkey_st;
struct x509_st;

namespace amhex::server {

struct PemPair {
  std::string certificate;
  std::string key;
};

class TestAuthority {
 public:
  TestAuthority();
  ~TestAuthority();

  const std::string& certificate() const { return certificate_; }
  // A certificate for the common name, and for localhost and the address.
  PemPair Sign(const std::string& common_name, const std::string& address = "127.0.0.1");

 private:
  evp_pkey_st* key_;
  x509_st* own_;
  std::string certificate_;
  int64_t next_serial_ = 2;
};

}  // namespace amhex::server
