// A whole image in a folder, or a whole video, as the program reads them: refused, or images of
// sides and channels that it can use. The decoders are libraries, which are not instrumented.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>

#include "sdk/input/image_stream.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/image_header.hpp"

namespace {

namespace fs = std::filesystem;

struct Folder {
    Folder() {
        std::string name = "/dev/shm/defrec-images-fuzz-XXXXXX";
        if (mkdtemp(name.data()) == nullptr) std::abort();
        path = name;
    }
    ~Folder() {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    fs::path path;
};

// What is large takes long, and says no more.
bool is_large(std::span<const unsigned char> bytes) {
    constexpr uint64_t kPixels = 1 << 20;
    const auto size = defrec::cli::image_header_size(bytes);
    return size && size->width != 0 && size->height > kPixels / size->width;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec::cli;
    static const Folder folder;
    if (is_large({data, size})) return 0;
    const fs::path file = folder.path / "0.png";  // its bytes say which format it is
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        const auto stream = ImageStream::open(begins_video({data, size}) ? file : folder.path);
        cv::Mat image;
        for (int i = 0; i < 4 && stream->read(image); ++i)
            if (image.empty() || image.depth() != CV_8U ||
                (image.channels() != 1 && image.channels() != 3))
                __builtin_trap();
    } catch (const CliError&) {
    }
    return 0;
}
