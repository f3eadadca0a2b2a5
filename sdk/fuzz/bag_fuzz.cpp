// A bag: an MCAP file, its topics, and its messages as images and calibrations.
#include "sdk/bag/mcap_reader.hpp"
#include "sdk/bag/stereo_topics.hpp"
#include "sdk/fuzz/bag_message.hpp"
#include "sdk/fuzz/memory_file.hpp"
#include "sdk/io/exit_code.hpp"

using namespace defrec::cli;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const defrec::fuzz::MemoryFile file({data, size});
    try {
        McapReader reader(file.path());
        BagMessage message;
        while (reader.next(message)) defrec::fuzz::take(message);
        static_cast<void>(choose_topics("fuzz", topics_of_mcap(file.path()), "", ""));
    } catch (const CliError&) {
    }
    return 0;
}
