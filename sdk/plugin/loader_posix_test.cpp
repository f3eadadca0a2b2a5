// The loader's refusals of what other systems do not have.
#include <doctest/doctest.h>
#include <elf.h>
#include <sys/stat.h>

#include <cstring>

#include "sdk/plugin/test_loader.hpp"

using namespace defrec::test;
namespace fs = std::filesystem;

TEST_CASE("row 32: a FIFO, a folder, a text file and nothing at all in the library's place") {
    const TemporaryFolder folder;
    const fs::path library = folder.path() / kLibrary;
    write_file(folder.path() / kManifest, manifest_text(kLibrary, {}));
    check_refused(folder.path(), DEFREC_ERROR_IO, {kLibrary, "No such file"});
    REQUIRE(mkfifo(library.c_str(), 0600) == 0);
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kLibrary, "not a regular file"});
    fs::remove(library);
    fs::create_directory(library);
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kLibrary, "not a regular file"});
    fs::remove(library);
    write_file(library, std::string(1000, 'x'));
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kLibrary, "not a shared object"});
}

TEST_CASE("row 32: a FIFO, a folder and a text file in the manifest's place") {
    const TemporaryFolder folder;
    const fs::path manifest = folder.path() / kManifest;
    REQUIRE(mkfifo(manifest.c_str(), 0600) == 0);
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kManifest, "not a regular file"});
    fs::remove(manifest);
    fs::create_directory(manifest);
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kManifest, "not a regular file"});
    fs::remove(manifest);
    write_file(manifest, std::string("hello"));
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kManifest, "not an object"});
    write_file(manifest, std::string(70000, ' '));
    check_refused(folder.path(), DEFREC_ERROR_PLUGIN, {kManifest, "70000 bytes"});
}

TEST_CASE("row 33: a library for another processor is refused") {
    const auto set_machine = [](auto& bytes) {
        const uint16_t machine = EM_S390;
        std::memcpy(bytes.data() + offsetof(Elf64_Ehdr, e_machine), &machine, sizeof machine);
    };
    check_changed(set_machine, true, DEFREC_ERROR_PLUGIN, {kLibrary, "another processor"});
}

TEST_CASE("row 35: a library that needs a symbol nobody has") {
    check_refused(stub_folder("undefined_symbol"), DEFREC_ERROR_PLUGIN,
                  {"stub_symbol_that_nobody_defines"});
}
