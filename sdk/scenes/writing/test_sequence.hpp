// For tests: a small rendered sequence, and one that takes long to track.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {

// Rendered once in a program.
template <int kFrames>
const TestFolder& rendered_sequence() {
    static const TestFolder folder;
    static const bool is_rendered = [] {
        RenderOptions options;
        options.scene = list_scenes().front().name;
        options.out_dir = folder.path().string();
        options.width = 320;
        options.height = 240;
        options.frames = kFrames;
        render_sequence(options, {});
        return true;
    }();
    static_cast<void>(is_rendered);
    return folder;
}

// In the order of their names.
inline std::vector<std::filesystem::path> images_of(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

// Fills left/ and right/ of the folder with 2000 frames, those of the sequence again and again.
inline void repeat_sequence(const TestFolder& sequence, const TestFolder& folder) {
    namespace fs = std::filesystem;
    for (const char* view : {"left", "right"}) {
        fs::create_directory(folder / view);
        const std::vector<fs::path> files = images_of(sequence / view);
        for (std::size_t i = 0; i < 2000; ++i) {
            const std::string number = std::to_string(100000 + i);
            fs::create_symlink(files[i % files.size()], folder.path() / view / (number + ".png"));
        }
    }
}

}  // namespace defrec::cli
