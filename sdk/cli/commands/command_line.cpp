// See command_line.hpp.
#include "sdk/cli/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string_view>
#include <vector>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/cli/commands/suggestion.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {
namespace {

// `defrec help` and `defrec help track` as `defrec --help` and `defrec track --help`.
std::vector<const char*> with_help_as_option(const CLI::App& app, int argc,
                                             const char* const* argv) {
    std::vector<const char*> words(argv, argv + argc);
    if (argc < 2 || std::string_view(argv[1]) != "help" || app.get_subcommands({}).empty())
        return words;
    words.erase(words.begin() + 1);
    words.resize(std::min<std::size_t>(words.size(), 2));
    words.push_back("--help");
    return words;
}

}  // namespace

int carry_out(CLI::App& app, const std::function<int()>& run, int typed_count,
              const char* const* typed) {
    try {
        const std::vector<const char*> words = with_help_as_option(app, typed_count, typed);
        const int argc = static_cast<int>(words.size());
        const char* const* argv = words.data();
        if (const std::string unknown = misspelling(app, argc, argv); !unknown.empty())
            throw CliError(ExitCode::kUsage, unknown);
        try {
            app.parse(argc, argv);
        } catch (const CLI::RequiredError& error) {
            const std::string missing = what_is_missing(app, argc, argv);
            if (missing.empty()) throw CliError(ExitCode::kUsage, error.what());
            // Several lines, none of which has anything that was typed.
            std::fputs(("defrec: " + missing + "\n").c_str(), stderr);
            return static_cast<int>(ExitCode::kUsage);
        } catch (const CLI::ParseError& error) {
            if (error.get_exit_code() != 0)
                throw CliError(ExitCode::kUsage,
                               std::string(error.what()) + ". --help says what is taken.");
            app.exit(error);
            return static_cast<int>(ExitCode::kOk);
        }
        return run();
    } catch (const CliError& error) {
        print_notice(error.what());
        return static_cast<int>(error.code());
    } catch (const FileError& error) {
        print_notice(std::string(error.what()) + ".");
        return static_cast<int>(ExitCode::kOutput);
    } catch (const std::bad_alloc&) {
        print_notice("out of memory.");
    } catch (const std::exception& error) {
        print_notice(std::string("internal error: ") + error.what());
    }
    return static_cast<int>(ExitCode::kInternal);
}

}  // namespace defrec::cli
