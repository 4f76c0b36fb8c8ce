# What Doxygen sees of a header: our comments say what it needs, in plainer marks than its own.
# The comment a header begins with describes the file.
1s|^// |//! @file\n//! |
1,/^#pragma once/s|^//( \|$)|//!\1|
# A comment behind a declaration describes it.
s|^( .*[;,}]) +// (.*)|\1 ///< \2|
# Angle brackets in prose are not tags.
/^ *\/\/[\/!]/s/<([a-zA-Z])/\\<\1/g
