#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <vector>

#include "sdk/base/os/descriptor.hpp"

using namespace defrec;

namespace {

bool is_open(int descriptor) { return ::fcntl(descriptor, F_GETFD) >= 0; }

}  // namespace

TEST_CASE("a descriptor is closed with its last owner, once") {
    Pipe pipe;
    REQUIRE(pipe.open());
    const int number = pipe.read_end.get();
    {
        Descriptor owner = std::move(pipe.read_end);
        CHECK_FALSE(pipe.read_end);
        CHECK(owner.get() == number);
        CHECK(is_open(number));
    }
    CHECK_FALSE(is_open(number));
}

TEST_CASE("what takes a descriptor over closes its own") {
    Pipe first, second;
    REQUIRE(first.open());
    REQUIRE(second.open());
    const int lost = first.write_end.get(), kept = second.write_end.get();
    first.write_end = std::move(second.write_end);
    CHECK_FALSE(is_open(lost));
    CHECK(first.write_end.get() == kept);
    first.write_end.close();
    CHECK_FALSE(is_open(kept));
    CHECK_FALSE(first.write_end);
}

TEST_CASE(
    "the end of a pipe is seen when its other end is closed, and no program inherits either") {
    Pipe pipe;
    REQUIRE(pipe.open());
    for (const Descriptor* end : {&pipe.read_end, &pipe.write_end})
        CHECK((::fcntl(end->get(), F_GETFD) & FD_CLOEXEC) != 0);
    CHECK(::write(pipe.write_end.get(), "x", 1) == 1);
    pipe.write_end.close();
    char bytes[2];
    CHECK(::read(pipe.read_end.get(), bytes, 2) == 1);
    CHECK(::read(pipe.read_end.get(), bytes, 2) == 0);
}
