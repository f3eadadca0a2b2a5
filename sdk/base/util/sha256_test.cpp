#include "sdk/base/util/sha256.hpp"

#include <doctest/doctest.h>

#include <string>
#include <vector>

using defrec::sha256_hex;

namespace {
std::string hash_of(const std::string& text) {
    return sha256_hex(std::vector<unsigned char>(text.begin(), text.end()));
}
}  // namespace

TEST_CASE("SHA-256 gives the examples of FIPS 180-4 and the NIST test vectors") {
    CHECK(hash_of("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    CHECK(hash_of("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(hash_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
          "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    CHECK(hash_of(std::string(1000000, 'a')) ==
          "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("every length round a block's border pads differently") {
    std::vector<std::string> hashes;
    for (size_t size = 50; size < 70; ++size) hashes.push_back(hash_of(std::string(size, 'x')));
    for (size_t i = 0; i < hashes.size(); ++i)
        for (size_t k = 0; k < i; ++k) CHECK(hashes[i] != hashes[k]);
    // 55, 56 and 64 bytes: the last that fits one block, the first that does not, a block exactly
    // (coreutils' sha256sum).
    CHECK(hash_of(std::string(55, 'a')) ==
          "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318");
    CHECK(hash_of(std::string(56, 'a')) ==
          "b35439a4ac6f0948b6d6f9e3c6af0f5f590ce20f1bde7090ef7970686ec6738a");
    CHECK(hash_of(std::string(64, 'a')) ==
          "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb");
}
