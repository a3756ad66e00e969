/* A program that starts itself again and hangs, as does the second process, which writes a file if it lives on. */
#include <stdio.h>
#include <string.h>
#include <windows.h>

int main(int count, char **arguments) {
    char path[MAX_PATH], command[MAX_PATH + 16];
    STARTUPINFOA startup = {.cb = sizeof startup};
    PROCESS_INFORMATION process;
    if (count == 3 && strcmp(arguments[1], "child") == 0) {
        Sleep(6000);
        fclose(fopen(arguments[2], "w"));
        return 0;
    }
    GetModuleFileNameA(NULL, path, sizeof path);
    snprintf(command, sizeof command, "\"%s\" child %s", path, getenv("ALIVE"));
    CreateProcessA(path, command, NULL, NULL, FALSE, 0, NULL, NULL, &startup, &process);
    Sleep(60000);
    return 0;
}
