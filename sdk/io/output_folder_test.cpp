// Row 72: a folder that cannot be created ends with exit code 7.
#include "sdk/io/output_folder.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

std::string failure_of(const std::string& path) {
    try {
        create_output_folder(path);
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kOutput);
        return error.what();
    }
    return "no failure";
}

}  // namespace

TEST_CASE("row 72: where a file is in the way, the message says so and what to do") {
    const TestFolder folder;
    const std::string file = folder.write("file", "");
    CHECK(failure_of(file).find("--out") != std::string::npos);
    CHECK(failure_of(file + "/inner").find("--out") != std::string::npos);
}

TEST_CASE(
    "row 75: a folder and its parents, in UTF-8; one that is there already is taken as it is") {
    const TestFolder folder;
    const std::string inner = folder / "Läsion/肝臓";
    create_output_folder(inner);
    create_output_folder(inner);
    CHECK(std::filesystem::is_directory(inner));
}

TEST_CASE("row 85: a second run in the same folder is refused while the first writes") {
    const TestFolder folder;
    const std::string path = folder / "out";
    create_output_folder(path);
    {
        const OutputFolder first(path);
        CHECK_THROWS_AS(OutputFolder{path}, CliError);
    }
    const OutputFolder next(path);
}
