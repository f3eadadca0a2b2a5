// See shared_object.hpp. Reads the headers of 64-bit ELF, little endian: all that the supported
// platforms use.
#include <elf.h>

#include <cstring>

#include "sdk/plugin/library_bytes.hpp"
#include "sdk/plugin/shared_object.hpp"

namespace defrec {
namespace {

#if defined(__x86_64__)
constexpr uint16_t kMachine = EM_X86_64;
#elif defined(__aarch64__)
constexpr uint16_t kMachine = EM_AARCH64;
#else
#error "name this machine's ELF number here"
#endif

class ElfFile : LibraryBytes {
  public:
    using LibraryBytes::LibraryBytes;

    void check() {
        if (bytes().size() < sizeof header_ || std::memcmp(bytes().data(), ELFMAG, SELFMAG) != 0)
            refuse("not a shared object");
        std::memcpy(&header_, bytes().data(), sizeof header_);
        check_header();
        check_segments();
        check_sections();
    }

  private:
    void check_header() const {
        if (header_.e_ident[EI_CLASS] != ELFCLASS64 || header_.e_ident[EI_DATA] != ELFDATA2LSB ||
            header_.e_ident[EI_VERSION] != EV_CURRENT)
            refuse("made for another kind of processor (not 64-bit little endian)");
        if (header_.e_machine != kMachine)
            refuse("made for another processor: machine ", header_.e_machine, ", expected ",
                   kMachine);
        if (header_.e_type != ET_DYN) refuse("not a shared object");
        if (header_.e_ehsize != sizeof(Elf64_Ehdr) || header_.e_phentsize != sizeof(Elf64_Phdr))
            refuse("damaged header");
    }

    void check_segments() const {
        expect_inside(header_.e_phoff, uint64_t{header_.e_phnum} * sizeof(Elf64_Phdr),
                      "the segment table");
        bool loads = false, dynamic = false;
        for (size_t i = 0; i < header_.e_phnum; ++i) {
            const auto segment = record<Elf64_Phdr>(header_.e_phoff, i);
            loads = loads || segment.p_type == PT_LOAD;
            dynamic = dynamic || segment.p_type == PT_DYNAMIC;
            if (segment.p_type != PT_LOAD && segment.p_type != PT_DYNAMIC) continue;
            expect_inside(segment.p_offset, segment.p_filesz, "a segment");
            if (segment.p_type == PT_LOAD && segment.p_filesz > segment.p_memsz)
                refuse("damaged segment table");
        }
        if (!loads || !dynamic) refuse("not a shared object");
    }

    void check_sections() const {
        if (header_.e_shoff == 0) return;
        if (header_.e_shentsize != sizeof(Elf64_Shdr)) refuse("damaged header");
        expect_inside(header_.e_shoff, uint64_t{header_.e_shnum} * sizeof(Elf64_Shdr),
                      "the section table");
        for (size_t i = 0; i < header_.e_shnum; ++i) {
            const auto section = record<Elf64_Shdr>(header_.e_shoff, i);
            if (section.sh_type != SHT_NOBITS && section.sh_type != SHT_NULL)
                expect_inside(section.sh_offset, section.sh_size, "a section");
        }
    }

    Elf64_Ehdr header_{};
};

}  // namespace

void check_shared_object(const std::string& path, std::span<const unsigned char> bytes) {
    ElfFile(path, bytes).check();
}

}  // namespace defrec
