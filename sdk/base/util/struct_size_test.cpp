#include "sdk/base/util/struct_size.hpp"

#include <doctest/doctest.h>

#include <array>

using namespace defrec;

namespace {

struct Known {
    uint32_t struct_size;
    uint32_t a;
    uint64_t b;
};
struct Newer {
    Known known;
    uint64_t c;
};

defrec_status status_of(const void* given) {
    try {
        read_struct<Known>("s", given);
        return DEFREC_OK;
    } catch (const Error& error) {
        return error.status();
    }
}

}  // namespace

TEST_CASE("row 17: a shorter struct reads as if its missing fields were zero") {
    const Known given{8, 5, 77};
    const Known read = read_struct<Known>("s", &given);
    CHECK(read.a == 5);
    CHECK(read.b == 0);
    CHECK(read.struct_size == sizeof(Known));
}

TEST_CASE("row 17: a longer struct is accepted if its unknown tail is zero") {
    Newer given{{sizeof(Newer), 5, 77}, 0};
    CHECK(read_struct<Known>("s", &given).b == 77);
    given.c = uint64_t{1} << 63;
    CHECK(status_of(&given) == DEFREC_ERROR_VERSION);
}

TEST_CASE("row 17: struct_size 0, too small for itself and absurd ones are refused") {
    Known given{0, 1, 2};
    for (const uint32_t size : {0u, 1u, 3u, 65537u, UINT32_MAX}) {
        given.struct_size = size;
        CHECK(status_of(&given) == DEFREC_ERROR_VERSION);
    }
    CHECK(status_of(nullptr) == DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("row 24: of an output as many bytes are written as both sides know") {
    std::array<Newer, 2> out;
    const Known value{sizeof(Known), 1, 2};
    for (const uint32_t size : {8u, 12u, 16u, 24u}) {
        std::memset(static_cast<void*>(&out), 0xA5, sizeof out);
        out[0].known.struct_size = size;
        write_struct(&out[0].known, value);
        const auto* bytes = reinterpret_cast<const unsigned char*>(&out);
        CHECK(out[0].known.struct_size == size);
        CHECK(out[0].known.a == 1);
        for (size_t i = std::min<size_t>(size, sizeof value); i < sizeof out; ++i)
            CHECK(bytes[i] == 0xA5);
    }
}
