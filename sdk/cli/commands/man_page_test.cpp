// The manual pages: one for each command, with all of its options, as roff takes it.
#include "sdk/cli/commands/man_page.hpp"

#include <doctest/doctest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <functional>
#include <regex>
#include <string>
#include <vector>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

struct Program {
    CLI::App app;
    std::function<int()> run;
    Program() { add_commands(app, run); }
    std::vector<const CLI::App*> commands() const {
        return const_cast<const CLI::App&>(app).get_subcommands({});
    }
};

// The page as it is read, without requests.
std::string text_of(const std::string& page) {
    return std::regex_replace(page, std::regex("\\\\-"), "-");
}

// Names of options at the beginnings of lines of --help.
std::vector<std::string> options_in(const std::string& help) {
    std::vector<std::string> names;
    const std::regex line("\n  (-[^ \n]+)"), name("-[-a-z0-9]*");
    for (std::sregex_iterator i(help.begin(), help.end(), line), none; i != none; ++i) {
        const std::string found = (*i)[1];
        for (std::sregex_iterator each(found.begin(), found.end(), name); each != none; ++each)
            names.push_back(each->str());
    }
    return names;
}

}  // namespace

TEST_CASE("the page of each command names every option that --help names, and no other") {
    const Program program;
    std::size_t options = 0;
    for (const CLI::App* command : program.commands()) {
        CAPTURE(command->get_name());
        const std::string page = text_of(man_page(*command, "1.2.3"));
        CHECK(page.find("defrec 1.2.3") != std::string::npos);
        CHECK(page.find("\n.SH NAME\ndefrec-" + command->get_name() + " - ") != std::string::npos);
        const std::vector<std::string> names = options_in(command->help());
        CHECK(names.size() > 1);
        options += names.size();
        std::size_t entries = 0;
        for (std::size_t at = page.find("\n.TP\n.B -"); at != std::string::npos;
             at = page.find("\n.TP\n.B -", at + 1))
            ++entries;
        for (const std::string& name : names) {
            CAPTURE(name);
            const std::regex entry("\n\\.TP\n\\.B (-[^\n]*,)?" + name + "[ ,\n]");
            CHECK(std::regex_search(page, entry));
        }
        CHECK(entries <= names.size());
    }
    CHECK(options > 100);
}

TEST_CASE("the program's page names each command, and so does the list of the Debian package") {
    const Program program;
    const std::string page = text_of(man_page_of_program(program.app, "1.2.3"));
    const std::string files =
        TestFolder::read(DEFREC_SOURCE_DIR "/cmake/packaging/deb/files/defrec-tools.txt");
    CHECK(files.find("share/man/man1/defrec.1.gz\n") != std::string::npos);
    CHECK(program.commands().size() > 10);
    for (const CLI::App* command : program.commands()) {
        const std::string name = "defrec-" + command->get_name();
        CAPTURE(name);
        CHECK(page.find("\n.BR " + name + " (1)\n") != std::string::npos);
        CHECK(files.find("share/man/man1/" + name + ".1.gz\n") != std::string::npos);
    }
}

TEST_CASE("no text of an option is a request of roff, and examples stay as they are") {
    CLI::App app("x");
    app.name("defrec");
    CLI::App* command = app.add_subcommand("try", ".so is no request here");
    int value = 0;
    command->add_option("--path", value, "'C:\\new' or \"-n\" or `x`; ^~")->type_name(".X");
    command->footer("Text.\n\n.PP of a user\nExamples:\n  defrec try --path 'a\\b'\n  .so x\nEnd.");
    const std::string page = man_page(*command, "1");
    CHECK(page.find("\n\\&.so is no request here.\n") != std::string::npos);
    CHECK(page.find("\n\\(aqC:\\enew\\(aq or \\(dq\\-n\\(dq or \\(gax\\(ga; \\(ha\\(ti\n") !=
          std::string::npos);
    CHECK(page.find("\n\\&.PP of a user\n") != std::string::npos);
    CHECK(page.find(
              "\n.PP\n.nf\ndefrec try \\-\\-path \\(aqa\\eb\\(aq\n\\&.so x\n.fi\n.PP\nEnd.\n") !=
          std::string::npos);
}

TEST_CASE("groff formats each page without a warning" *
          doctest::skip(std::system("command -v groff >/dev/null 2>&1") != 0)) {
    const TestFolder folder;
    const Program program;
    std::vector<std::string> pages{man_page_of_program(program.app, "1")};
    for (const CLI::App* command : program.commands()) pages.push_back(man_page(*command, "1"));
    for (const std::string& page : pages) {
        const std::string file = folder.write("page.1", page), log = folder / "log";
        REQUIRE(std::system(("groff -man -ww -Tutf8 -z " + file + " 2> " + log).c_str()) == 0);
        CHECK(TestFolder::read(log).empty());
    }
}
