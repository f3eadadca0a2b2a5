// On every system, with a DLL that is put together here; on Windows the loader's tests check real
// ones.
#include "sdk/plugin/pe_file.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <random>
#include <vector>

#include "sdk/plugin/pe_format.hpp"
#include "sdk/plugin/test_refusal.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

using Bytes = std::vector<unsigned char>;

constexpr uint32_t kSignaturePlace = 0x80, kPage = 0x1000, kFileUnit = 0x200;

// What a DLL of two sections consists of, in the order of the file.
struct Dll {
    pe::FileHeader header{};
    pe::OptionalHeader image{};
    pe::DataDirectory directories[pe::kMaxDirectories]{};
    pe::SectionHeader sections[2]{};
    uint32_t names_size = 20;

    Dll() {
        header.machine = pe::kMachineAmd64;
        header.number_of_sections = 2;
        header.size_of_optional_header = sizeof image + sizeof directories;
        header.characteristics = pe::kExecutableImage | pe::kDll;
        header.pointer_to_symbol_table = 3 * kFileUnit;
        header.number_of_symbols = 2;
        image.magic = pe::kPe32Plus;
        image.section_alignment = kPage;
        image.file_alignment = kFileUnit;
        image.size_of_image = 4 * kPage;
        image.size_of_headers = kFileUnit;
        image.number_of_rva_and_sizes = pe::kMaxDirectories;
        directories[pe::kExportTable] = {3 * kPage, 40};
        // The second is longer in the image than in the file, the rest is zero.
        sections[0] = {".text", 100, kPage, kFileUnit, kFileUnit, {}, 0};
        sections[1] = {".data", 2 * kPage, 2 * kPage, kFileUnit, 2 * kFileUnit, {}, 0};
    }

    Bytes bytes() const {
        const uint64_t names =
            header.pointer_to_symbol_table + header.number_of_symbols * pe::kSymbolSize;
        Bytes file(3 * kFileUnit + 2 * pe::kSymbolSize + 20);
        size_t at = 0;
        const auto put = [&](const auto& what, size_t size) {
            std::memcpy(file.data() + at, &what, size);
            at += size;
        };
        put("MZ", 2);
        at = pe::kHeaderPlace;
        put(kSignaturePlace, sizeof kSignaturePlace);
        at = kSignaturePlace;
        put("PE\0", 4);
        put(header, sizeof header);
        put(image, sizeof image);
        put(directories, sizeof directories);
        put(sections, sizeof sections);
        if (at = names; names + 4 <= file.size()) put(names_size, sizeof names_size);
        return file;
    }
};

std::string refusal(const Bytes& bytes) {
    return refusal_of([&] { check_dll("C:/x.dll", bytes, pe::kMachineAmd64); });
}

template <class Change>
std::string refusal_after(Change change) {
    Dll dll;
    change(dll);
    return refusal(dll.bytes());
}

}  // namespace

TEST_CASE("a DLL is accepted, with symbols, without them, and signed") {
    CHECK(refusal(Dll().bytes()) == "");
    CHECK(refusal_after([](Dll& dll) { dll.header.pointer_to_symbol_table = 0; }) == "");
    // A signature's place is one in the file.
    CHECK(refusal_after([](Dll& dll) {
              dll.directories[pe::kCertificateTable] = {2 * kFileUnit, kFileUnit};
          }) == "");
}

TEST_CASE("row 32: a DLL cut off anywhere is refused") {
    const Bytes whole = Dll().bytes();
    for (size_t size = 0; size < whole.size(); ++size)
        CHECK_MESSAGE(refusal(Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size))) != "",
                      "cut to ", size);
    CHECK(contains(refusal(Bytes(whole.begin(), whole.end() - 1)), "truncated"));
}

TEST_CASE("row 33: other processors and kinds of files are refused") {
    CHECK(contains(refusal_after([](Dll& dll) { dll.header.machine = pe::kMachineArm64; }),
                   "another processor"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.header.characteristics = pe::kDll; }),
                   "not a DLL"));
    CHECK(
        contains(refusal_after([](Dll& dll) { dll.header.characteristics = pe::kExecutableImage; }),
                 "not a DLL"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.image.magic = 0x010b; }), "damaged"));
    CHECK(contains(refusal(Bytes(2000, 'x')), "not a DLL"));
    Bytes no_signature = Dll().bytes();
    no_signature[kSignaturePlace] = 'N';
    CHECK(contains(refusal(no_signature), "not a DLL"));
}

TEST_CASE("row 34: headers that contradict each other or the file are refused") {
    CHECK(contains(refusal_after([](Dll& dll) { dll.header.size_of_optional_header = 100; }),
                   "damaged header"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.image.number_of_rva_and_sizes = 17; }),
                   "damaged header"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.image.size_of_headers = 0x100; }),
                   "damaged header"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.image.size_of_headers = UINT32_MAX; }),
                   "truncated"));
    CHECK(contains(refusal_after([](Dll& dll) {
                       dll.directories[1] = {UINT32_MAX, UINT32_MAX};
                   }),
                   "damaged header"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.directories[pe::kExportTable] = {}; }),
                   "exports nothing"));
    CHECK(contains(refusal_after([](Dll& dll) {
                       dll.directories[pe::kCertificateTable] = {UINT32_MAX, kFileUnit};
                   }),
                   "truncated"));
    CHECK(
        contains(refusal_after([](Dll& dll) { dll.header.number_of_sections = 0; }), "not a DLL"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.header.number_of_sections = UINT16_MAX; }),
                   "truncated"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.sections[1].virtual_address = kPage; }),
                   "damaged section table"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.sections[1].virtual_size = UINT32_MAX; }),
                   "damaged section table"));
    CHECK(
        contains(refusal_after([](Dll& dll) { dll.sections[0].pointer_to_raw_data = UINT32_MAX; }),
                 "truncated"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.header.number_of_symbols = UINT32_MAX; }),
                   "truncated"));
    CHECK(contains(refusal_after([](Dll& dll) { dll.names_size = 21; }), "truncated"));
}

TEST_CASE("row 34: no damage to the headers makes the check itself read outside the file") {
    std::mt19937 random(7);
    const Bytes whole = Dll().bytes();
    for (int i = 0; i < 20000; ++i) {
        Bytes bytes = whole;
        bytes[random() % kFileUnit] = static_cast<unsigned char>(random());
        bytes[pe::kHeaderPlace + random() % 4] = static_cast<unsigned char>(random());
        bytes.shrink_to_fit();
        refusal(bytes);
    }
    CHECK(refusal(whole) == "");
}
