// See chunk_compression.hpp.
#include "sdk/bag/chunk_compression.hpp"

#include <algorithm>
#include <memory>

#include "sdk/io/text.hpp"

#ifdef DEFREC_WITH_LZ4
#include <lz4frame.h>
#endif
#ifdef DEFREC_WITH_ZSTD
#include <zstd.h>
#endif

namespace defrec::cli {
namespace {

using Buffer = std::vector<unsigned char>;

[[maybe_unused]] constexpr std::size_t kFirstStep = std::size_t{1} << 20;

[[maybe_unused]] std::string wrong_size(std::size_t size) {
    return "is damaged: it does not unpack to the " + std::to_string(size) +
           " bytes that it claims.";
}

[[maybe_unused]] std::string unavailable(const char* name, const char* library) {
    return std::string("is compressed by ") + name + ", and this program was built without " +
           library + "; rewrite the bag without compression, for instance with `ros2 bag convert`.";
}

// step: takes bytes from the first and fills the second, and says how many of each it was; false
// where it cannot. The end comes with the claimed size.
template <class Step>
[[maybe_unused]] std::string unpack_by(const Step& step, ByteView packed, std::size_t size,
                                       Buffer& out) {
    out.resize(std::min(size, kFirstStep));
    std::size_t filled = 0;
    while (true) {
        std::size_t taken = packed.size(), made = out.size() - filled;
        if (!step(packed, taken, out.data() + filled, made)) return "is damaged.";
        packed = packed.subspan(taken);
        filled += made;
        if (filled == size && packed.empty()) return {};
        if (filled == out.size() && filled < size)
            out.resize(std::min(size, 2 * out.size()));
        else if (taken == 0 && made == 0)
            return wrong_size(size);
    }
}

std::string unpack_lz4([[maybe_unused]] ByteView packed, [[maybe_unused]] std::size_t size,
                       [[maybe_unused]] Buffer& out) {
#ifdef DEFREC_WITH_LZ4
    LZ4F_dctx* made_context = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made_context, LZ4F_VERSION)) != 0)
        return "cannot be unpacked: there is no memory.";
    const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
        made_context, &LZ4F_freeDecompressionContext);
    const auto step = [&](ByteView from, std::size_t& taken, unsigned char* to, std::size_t& made) {
        return LZ4F_isError(
                   LZ4F_decompress(context.get(), to, &made, from.data(), &taken, nullptr)) == 0;
    };
    return unpack_by(step, packed, size, out);
#else
    return unavailable("lz4", "liblz4");
#endif
}

std::string unpack_zstd([[maybe_unused]] ByteView packed, [[maybe_unused]] std::size_t size,
                        [[maybe_unused]] Buffer& out) {
#ifdef DEFREC_WITH_ZSTD
    // Its window is at most 128 MiB, zstd's default.
    const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                            &ZSTD_freeDStream);
    if (stream == nullptr) return "cannot be unpacked: there is no memory.";
    const auto step = [&](ByteView from, std::size_t& taken, unsigned char* to, std::size_t& made) {
        ZSTD_inBuffer input{from.data(), taken, 0};
        ZSTD_outBuffer output{to, made, 0};
        const std::size_t status = ZSTD_decompressStream(stream.get(), &output, &input);
        taken = input.pos;
        made = output.pos;
        return ZSTD_isError(status) == 0;
    };
    return unpack_by(step, packed, size, out);
#else
    return unavailable("zstd", "libzstd");
#endif
}

}  // namespace

std::string unpack(std::string_view compression, ByteView packed, std::size_t size,
                   std::vector<unsigned char>& out) {
    if (compression == "lz4") return unpack_lz4(packed, size, out);
    if (compression == "zstd") return unpack_zstd(packed, size, out);
    if (!compression.empty())
        return "is compressed by '" + printable(compression.substr(0, 40)) +
               "'; none, lz4 and zstd can be read.";
    if (packed.size() != size) return wrong_size(size);
    out.assign(packed.begin(), packed.end());
    return {};
}

}  // namespace defrec::cli
