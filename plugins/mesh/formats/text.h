// Lines, words and numbers of text files, in any locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace solidtex::mesh {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
constexpr bool is_line_end(char c) { return c == '\n' || c == '\r'; }

// Without the mark that some editors put in front of UTF-8.
std::string_view without_bom(std::string_view text);

// Takes a line off the text; it ends with LF, CR LF or CR, or with the text.
std::string_view take_line(std::string_view& text);

// Takes a word off a line; empty at its end.
std::string_view take_word(std::string_view& line);

// All of the word as a number, decimal point and exponent as in C; infinity and "nan" count, also
// as Microsoft's library writes them ("-1.#IND").
std::optional<double> to_number(std::string_view word);
std::optional<std::int64_t> to_integer(std::string_view word);

// Of ASCII letters.
std::string in_small_letters(std::string_view word);

// A word for a message: cut short, without characters that cannot be printed.
std::string quote(std::string_view word);

}  // namespace solidtex::mesh
