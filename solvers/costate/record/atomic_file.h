// Atomic file writing: a result file appears complete or not at all. The content is written to a sibling
// temporary, flushed to disk and renamed over the final path, so that an exception, a full disk or a
// killed process never leaves a half-written file and never damages the file that was there before.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace costate {

/// Writes `path` atomically. `write` receives the path of a temporary in the same directory (it exists and
/// is empty) and must leave the complete content there; the temporary is then fsynced and renamed to `path`.
///
/// A missing parent directory is created. An existing file keeps its permissions; a symbolic link is
/// followed, so that the link stays and its target is replaced. On any exception the temporary is removed and
/// an existing file at `path` is left as it was; an exception of `write` passes through unchanged.
///
/// Throws Error, naming the path and the reason, if the directory cannot be created or written, if `path`
/// is a directory or another non-regular file (a device, a pipe), or if syncing or renaming fails.
void write_file_atomically(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path& temporary)>& write);

/// Writes `content` (bytes, unchanged) to `path` atomically; see above. Throws Error also when writing fails.
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

}  // namespace costate
