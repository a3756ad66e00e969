#pragma once

// Ends the program: something needs what is not there yet.
[[noreturn]] void not_implemented(const char* name);
