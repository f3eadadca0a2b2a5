// Messages of an MCAP file (https://mcap.dev/spec), in the order in which they were written. The
// file is read once from front to back, and the memory is that of its largest chunk.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sdk/bag/bag_reader.hpp"

namespace defrec::cli {

class McapReader : public BagReader {
  public:
    // Throws CliError(kInput) for what is no MCAP file or cannot be opened.
    explicit McapReader(const std::filesystem::path& path);
    ~McapReader() override;
    McapReader(const McapReader&) = delete;
    McapReader& operator=(const McapReader&) = delete;

    bool next(BagMessage& message) override;
    const std::string& fault() const override;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// By the file's summary, or where it has none by its messages, up to where it is cut off or
// damaged. Throws like McapReader.
std::vector<BagTopic> topics_of_mcap(const std::filesystem::path& path);

}  // namespace defrec::cli
