// See command_line.hpp.
#include "sdk/cli/commands/command_line.hpp"

#include <CLI/CLI.hpp>
#include <exception>
#include <new>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/cli/commands/suggestion.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {

int carry_out(CLI::App& app, const std::function<int()>& run, int argc, const char* const* argv) {
    try {
        if (const std::string unknown = misspelling(app, argc, argv); !unknown.empty())
            throw CliError(ExitCode::kUsage, unknown);
        try {
            app.parse(argc, argv);
        } catch (const CLI::ParseError& error) {
            return static_cast<int>(app.exit(error) == 0 ? ExitCode::kOk : ExitCode::kUsage);
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
