// Rendered frames in the layouts of public data sets.
#include "sdk/scenes/writing/layouts.hpp"

#include <map>
#include <memory>

#include "sdk/scenes/writing/layout_writer.hpp"

namespace defrec::cli {
namespace {

using MakeWriter = std::unique_ptr<LayoutWriter> (*)(const RenderOptions&, const Scene&);

const std::map<std::string, MakeWriter>& writers() {
    static const std::map<std::string, MakeWriter> writers{
        {"hamlyn", make_hamlyn_writer},   {"scared", make_scared_writer},
        {"serv-ct", make_serv_ct_writer}, {"stereomis", make_stereomis_writer},
        {"stir", make_stir_writer},       {"stir-2026", make_stir_2026_writer},
        {"super", make_super_writer},     {"surgt", make_surgt_writer},
    };
    return writers;
}

}  // namespace

std::vector<std::string> public_layouts() {
    std::vector<std::string> names;
    for (const auto& [name, make] : writers()) names.push_back(name);
    return names;
}

int render_layout(const RenderOptions& options, int frames, int threads, const ProgressFn& progress,
                  const StopFn& stop) {
    Film film(options.scene, options.width, options.height, frames, options.seed, threads,
              options.settings);
    if (film.scene().compression.jpeg_quality > 0 || film.scene().compression.h264_contrast > 0) {
        throw RenderUsageError("scene '" + options.scene +
                               "' is compressed in its own way; --layout takes the others");
    }
    try {
        const std::unique_ptr<LayoutWriter> writer =
            writers().at(options.layout)(options, film.scene());
        int frame = 0;
        for (; frame < frames && (frame == 0 || !stop || !stop()); ++frame) {
            film.advance();
            writer->add(film, frame);
            if (progress) progress(frame + 1, frames);
        }
        writer->finish();
        return frame;
    } catch (const FileError& error) {
        throw RenderOutputError(error.what());
    }
}

}  // namespace defrec::cli
