// See pe_file.hpp.
#include "sdk/plugin/pe_file.hpp"

#include <cstring>

#include "sdk/plugin/library_bytes.hpp"
#include "sdk/plugin/pe_format.hpp"

namespace defrec {
namespace {

class PeFile : LibraryBytes {
  public:
    using LibraryBytes::LibraryBytes;

    void check(uint16_t machine) {
        constexpr std::string_view kStart = "MZ", kSignature{"PE\0\0", 4};
        if (!has(0, kStart)) refuse("not a DLL");
        expect_inside(pe::kHeaderPlace, sizeof(uint32_t), "the header");
        const auto signature = record<uint32_t>(pe::kHeaderPlace);
        const uint64_t header = uint64_t{signature} + kSignature.size(),
                       optional = header + sizeof file_header_;
        expect_inside(signature, kSignature.size() + sizeof file_header_ + sizeof image_,
                      "the header");
        if (!has(signature, kSignature)) refuse("not a DLL");
        file_header_ = record<pe::FileHeader>(header);
        image_ = record<pe::OptionalHeader>(optional);
        check_header(machine);
        check_directories(optional + sizeof image_);
        check_sections(optional + file_header_.size_of_optional_header);
        check_symbols();
    }

  private:
    bool has(uint64_t at, std::string_view text) const {
        return at <= bytes().size() && text.size() <= bytes().size() - at &&
               std::memcmp(bytes().data() + at, text.data(), text.size()) == 0;
    }

    bool is_in_image(uint64_t address, uint64_t size) const {
        return address + size <= image_.size_of_image;
    }

    void check_header(uint16_t machine) const {
        if (file_header_.machine != machine)
            refuse("made for another processor: machine ", file_header_.machine, ", expected ",
                   machine);
        constexpr uint16_t kKind = pe::kExecutableImage | pe::kDll;
        if ((file_header_.characteristics & kKind) != kKind) refuse("not a DLL");
        if (image_.magic != pe::kPe32Plus || image_.number_of_rva_and_sizes > pe::kMaxDirectories ||
            file_header_.size_of_optional_header <
                sizeof image_ + image_.number_of_rva_and_sizes * sizeof(pe::DataDirectory))
            refuse("damaged header");
        expect_inside(0, image_.size_of_headers, "the header");
    }

    void check_directories(uint64_t table) const {
        expect_inside(table, image_.number_of_rva_and_sizes * sizeof(pe::DataDirectory),
                      "the header");
        bool exports = false;
        for (uint32_t i = 0; i < image_.number_of_rva_and_sizes; ++i) {
            const auto directory = record<pe::DataDirectory>(table, i);
            if (directory.size == 0) continue;
            if (i == pe::kCertificateTable)
                expect_inside(directory.address, directory.size, "the signature");
            else if (!is_in_image(directory.address, directory.size))
                refuse("damaged header");
            exports = exports || i == pe::kExportTable;
        }
        if (!exports) refuse("not a library: it exports nothing");
    }

    void check_sections(uint64_t table) const {
        if (file_header_.number_of_sections == 0) refuse("not a DLL");
        const uint64_t size = uint64_t{file_header_.number_of_sections} * sizeof(pe::SectionHeader);
        expect_inside(table, size, "the section table");
        if (table + size > image_.size_of_headers) refuse("damaged header");
        uint64_t end = image_.size_of_headers;  // in the image, of what came before
        for (size_t i = 0; i < file_header_.number_of_sections; ++i) {
            const auto section = record<pe::SectionHeader>(table, i);
            expect_inside(section.pointer_to_raw_data, section.size_of_raw_data, "a section");
            if (section.virtual_address < end ||
                !is_in_image(section.virtual_address, section.virtual_size))
                refuse("damaged section table");
            end = uint64_t{section.virtual_address} + section.virtual_size;
        }
    }

    // Symbols of the linker, for debuggers: names that are longer than a symbol follow, their size
    // first.
    void check_symbols() const {
        if (file_header_.pointer_to_symbol_table == 0) return;
        const uint64_t names =
            file_header_.pointer_to_symbol_table + file_header_.number_of_symbols * pe::kSymbolSize;
        expect_inside(names, sizeof(uint32_t), "the symbol table");
        expect_inside(names, record<uint32_t>(names), "the symbol table");
    }

    pe::FileHeader file_header_{};
    pe::OptionalHeader image_{};
};

}  // namespace

void check_dll(const std::string& path, std::span<const unsigned char> bytes, uint16_t machine) {
    PeFile(path, bytes).check(machine);
}

}  // namespace defrec
