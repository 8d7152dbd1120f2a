// Sums of a render on disk, so that it goes on after a kill as if it had not been.
#pragma once

#include "row_array.hpp"

namespace lab {

// Replaces the file by one that has all sums, or leaves it as it is: whenever the process ends, one of both
// is there and whole. settings: what the sums depend on, in lines. Throws std::runtime_error where the file
// cannot be written.
void write_checkpoint(const std::string& file, const std::string& settings, int passes,
                      const std::vector<row_array>& sums);

// Reads what write_checkpoint has written to sums of the same names and sizes, and returns the passes that
// they are of; 0 and the sums as they were where there is no file. Throws std::runtime_error, with one line
// that says where, if the file is damaged, of other settings, or of more than so many passes; the sums may
// then be anything.
int read_checkpoint(const std::string& file, const std::string& settings, int most_passes,
                    const std::vector<row_array>& sums);

} // namespace lab
