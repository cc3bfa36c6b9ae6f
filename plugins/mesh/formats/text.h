// Lines, words and numbers of text files, independent of the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace solidtex::mesh {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
constexpr bool is_line_end(char c) { return c == '\n' || c == '\r'; }

// Removes a UTF-8 byte order mark.
std::string_view without_bom(std::string_view text);

// Removes and returns the first line, which ends with LF, CR LF, CR or the text.
std::string_view take_line(std::string_view& text);

// Removes and returns the first word of a line; empty at its end.
std::string_view take_word(std::string_view& line);

// Parses the whole word as a number in C syntax, with infinity and "nan", also as Microsoft's
// library writes them ("-1.#IND").
std::optional<double> to_number(std::string_view word);
std::optional<std::int64_t> to_integer(std::string_view word);

// Converts ASCII letters to lower case.
std::string in_small_letters(std::string_view word);

// At most 12 digits, for a message.
std::string number_text(double value);

// Quotes a word for a message: shortened, without unprintable characters.
std::string quote(std::string_view word);

}  // namespace solidtex::mesh
