// Files of one run beside the summary of another.
#include "sdk/session/written_files.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

TEST_CASE("row 120: a file of another run is told from those of the summary") {
    const TestFolder folder;
    folder.write("points.csv", "abc");
    folder.write("frames.csv", std::string(3'000'000, 'a'));
    WrittenFiles files(folder.path());
    files.add("points.csv");
    files.add("frames.csv");
    CHECK(files.json()[0]["bytes"] == 3);
    CHECK(files.json()[0]["sha256"] ==
          "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(files.json()[1]["bytes"] == 3'000'000);
    CHECK_THROWS_AS(files.add("absent"), CliError);

    const std::vector<std::string> names = {"points.csv", "frames.csv", "targets.csv"};
    CHECK(not_as_summarised(folder.path(), names).empty());
    nlohmann::ordered_json summary;
    folder.write("summary.json", summary.dump());
    CHECK(not_as_summarised(folder.path(), names).empty());
    summary["files"] = files.json();
    folder.write("summary.json", summary.dump());
    CHECK(not_as_summarised(folder.path(), names).empty());
    folder.write("points.csv", "abd");
    folder.write("targets.csv", "of an earlier run");
    CHECK(not_as_summarised(folder.path(), names) ==
          std::vector<std::string>{"points.csv", "targets.csv"});
}
