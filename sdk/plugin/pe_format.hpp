// The headers of 64-bit DLLs: of Microsoft's PE Format specification, little endian, those fields
// that pe_file.cpp reads under their names there.
#pragma once
#include <cstdint>

namespace defrec::pe {

constexpr uint16_t kMachineAmd64 = 0x8664, kMachineArm64 = 0xaa64;
constexpr uint32_t kHeaderPlace = 0x3c;  // where a file says where its signature lies
constexpr uint16_t kExecutableImage = 0x0002, kDll = 0x2000;  // Characteristics
constexpr uint16_t kPe32Plus = 0x020b;
constexpr uint64_t kSymbolSize = 18;
constexpr uint32_t kMaxDirectories = 16, kExportTable = 0, kCertificateTable = 4;

// Behind the signature "PE\0\0".
struct FileHeader {
    uint16_t machine;
    uint16_t number_of_sections;
    uint32_t time_date_stamp;
    uint32_t pointer_to_symbol_table;
    uint32_t number_of_symbols;
    uint16_t size_of_optional_header;
    uint16_t characteristics;
};
static_assert(sizeof(FileHeader) == 20);

struct OptionalHeader {
    uint16_t magic;
    uint8_t linker_version[2];
    uint32_t sizes_and_places[5];
    uint64_t image_base;
    uint32_t section_alignment;
    uint32_t file_alignment;
    uint16_t versions[6];
    uint32_t win32_version_value;
    uint32_t size_of_image;
    uint32_t size_of_headers;
    uint32_t check_sum;
    uint16_t subsystem;
    uint16_t dll_characteristics;
    uint64_t stack_and_heap[4];
    uint32_t loader_flags;
    uint32_t number_of_rva_and_sizes;
};
static_assert(sizeof(OptionalHeader) == 112);

// number_of_rva_and_sizes of them follow. An address is one in the image, but for
// kCertificateTable, where it is one in the file.
struct DataDirectory {
    uint32_t address;
    uint32_t size;
};

struct SectionHeader {
    char name[8];
    uint32_t virtual_size;
    uint32_t virtual_address;
    uint32_t size_of_raw_data;
    uint32_t pointer_to_raw_data;
    uint32_t relocations_and_line_numbers[3];
    uint32_t characteristics;
};
static_assert(sizeof(SectionHeader) == 40);

}  // namespace defrec::pe
