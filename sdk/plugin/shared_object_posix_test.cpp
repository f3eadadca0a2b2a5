#include <doctest/doctest.h>
#include <elf.h>

#include <cstring>
#include <random>

#include "sdk/plugin/shared_object.hpp"
#include "sdk/plugin/test_refusal.hpp"
#include "sdk/testing/test_files.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

using Bytes = std::vector<unsigned char>;

const Bytes& good_library() {
    static const Bytes bytes = read_file(stub_folder("good") / "defrec_plugin_good.so");
    return bytes;
}

std::string refusal(const Bytes& bytes) {
    return refusal_of([&] { check_shared_object("/x.so", bytes); });
}

template <class Change>
std::string refusal_after(Change change) {
    Bytes bytes = good_library();
    Elf64_Ehdr header;
    std::memcpy(&header, bytes.data(), sizeof header);
    change(header);
    std::memcpy(bytes.data(), &header, sizeof header);
    return refusal(bytes);
}

}  // namespace

TEST_CASE("a shared object is accepted") {
    REQUIRE(good_library().size() > 1000);
    CHECK(refusal(good_library()) == "");
}

TEST_CASE("row 32: a library cut off anywhere is refused") {
    const Bytes& whole = good_library();
    size_t cuts = 0;
    for (size_t size = 0; size < whole.size(); size += size < 4096 ? 1 : 61, ++cuts)
        CHECK_MESSAGE(refusal(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size))) != "",
                      "cut to ", size);
    CHECK(refusal(Bytes(whole.begin(), whole.end() - 1)) != "");
    CHECK(cuts > 300);
}

TEST_CASE("row 33: other processors, classes and kinds of files are refused") {
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_machine = EM_PPC64; }),
                   "another processor"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_ident[EI_CLASS] = ELFCLASS32; }),
                   "another kind of processor"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_ident[EI_DATA] = ELFDATA2MSB; }),
                   "another kind of processor"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_type = ET_REL; }), "not a shared object"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_phentsize = 8; }), "damaged"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_phoff = UINT64_MAX - 8; }), "truncated"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_shoff = UINT64_MAX - 8; }), "truncated"));
    CHECK(contains(refusal_after([](Elf64_Ehdr& h) { h.e_phnum = 0; }), "not a shared object"));
    CHECK(contains(refusal(Bytes(200, 'x')), "not a shared object"));
}

TEST_CASE("row 34: no damage to the headers makes the check itself read outside the file") {
    std::mt19937 random(7);
    for (int i = 0; i < 20000; ++i) {
        Bytes bytes = good_library();
        bytes[random() % 1024] = static_cast<unsigned char>(random());
        bytes[random() % 64] = static_cast<unsigned char>(random());
        refusal(bytes);
    }
    CHECK(refusal(good_library()) == "");
}
